import json
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from building import SHIPPED, RunPython, StartProgram, WriteDefinitions, process_environment

from composer.ament import ament_prefixes
from composer.interfaces.build.builder import (
    BuildError,
    Dependencies,
    DependencyMissingError,
    build_package,
)
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.package_folder import load_definitions

pytestmark = pytest.mark.ros

KINDS = (
    'bool',
    'byte',
    'char',
    'float32',
    'float64',
    'int8',
    'uint8',
    'int16',
    'uint16',
    'int32',
    'uint32',
    'int64',
    'uint64',
    'string',
    'wstring',
    'string<=5',
    'wstring<=5',
    'std_msgs/ColorRGBA',
    'all_parts/Part',
    'more_parts/Wheel',
)
ARRAYS = {'one': '', 'three': '[3]', 'up_to_four': '[<=4]', 'any': '[]'}

DEFINITIONS = {
    'msg/Part.msg': (
        '# A comment with C:\\users, "quotes" and é.\nint32 number\nmore_parts/Wheel[] wheels\n'
    ),
    'msg/Defaults.msg': (
        'bool a true\nbyte b 200\nchar c 66\nfloat32 d -1.5\nint64 e -9223372036854775808\n'
        'uint64 f 18446744073709551615\nstring g "it\'s é"\nwstring h "äö"\nstring<=3 i abc\n'
        'int16[2] j [1, -2]\nfloat64[] k [1.5, 2]\nstring[] l ["x, y", "z"]\nbool[<=3] m [true]\n'
        'byte[2] n [1, 2]\nchar[] o [1, 2]\nstring p\nint32[] q\n'
    ),
    'msg/Constants.msg': (
        'bool A=true\nbyte B=7\nchar C=66\nfloat64 D=-1.5\nint64 E=-9223372036854775808\n'
        'uint64 F=18446744073709551615\nstring G="it\'s é"\nint8 H=0x10\nstring I=\n'
    ),
    'srv/Nothing.srv': '---\n',
}
# Takes as long to compile as all others here.
EVERY_KIND = {
    'msg/Everything.msg': ''.join(
        f'{kind}{array} {name}_{index}\n'
        for index, kind in enumerate(KINDS)
        for name, array in ARRAYS.items()
    ),
    'srv/Everything.srv': 'Everything[] many\n---\nEverything one\n',
}
USED = {'msg/Wheel.msg': 'float64 radius 0.5\nstd_msgs/Header header\n'}

PROVIDE = """
import sys
from pathlib import Path
from composer.interfaces.build.provision import import_packages, provide_packages
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.packages import load_packages
names = sys.argv[1].split(',')
folders = dict(zip(names, map(Path, sys.argv[2:])))
provided = provide_packages(load_packages(folders, InterfaceCatalogue()), print)
import_packages(provided)
"""
PROVIDE_AND_LOCATE = PROVIDE + 'print(provided[-1].prefix)'

# Fills messages from a seed, by what their classes say of their fields.
FILL = """
import random, string
from array import array

def fill_value(kind, rng, load):
    numbers = {'boolean': lambda: rng.random() < 0.5, 'octet': lambda: bytes([rng.randrange(256)]),
               'float': lambda: rng.randrange(-8, 8) / 4, 'double': lambda: rng.uniform(-1, 1)}
    if kind in numbers:
        return numbers[kind]()
    if 'int' in kind and '/' not in kind:
        bits = int(kind.removeprefix('u').removeprefix('int'))
        low = 0 if kind.startswith('u') else -2 ** (bits - 1)
        return rng.choice([low, low + 2**bits - 1, rng.randrange(low, low + 2**bits)])
    if kind.startswith(('string', 'wstring')):
        letters = string.ascii_letters if kind.startswith('string') else 'aé€'
        return ''.join(rng.choice(letters) for _ in range(rng.randrange(6)))
    return fill(load(kind), rng, load)

def fill(message_class, rng, load):
    message = message_class()
    for name, kind in message_class.get_fields_and_field_types().items():
        if kind.startswith('sequence<'):
            kind, _, bound = kind.removeprefix('sequence<').removesuffix('>').partition(', ')
            count = rng.randrange(int(bound or 6) + 1)
        elif kind.endswith(']'):
            kind, _, count = kind.removesuffix(']').rpartition('[')
            count = int(count)
        else:
            setattr(message, name, fill_value(kind, rng, load))
            continue
        setattr(message, name, [fill_value(kind, rng, load) for _ in range(count)])
    return message

def load(name):
    package, message = name.split('/')
    return getattr(__import__(f'{package}.msg').msg, message)
"""


@pytest.fixture(scope='module')
def parts(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ...]:
    """Write the definitions of three packages, which use one another."""
    folders = tuple(map(tmp_path_factory.mktemp, ('all_parts', 'more_parts', 'every_kind')))
    for folder, files in zip(folders, (DEFINITIONS, USED, EVERY_KIND), strict=True):
        for name, text in files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text, encoding='utf-8')
    return folders


@pytest.mark.usefixtures('domain_id')
@pytest.mark.long
def test_every_kind_of_field_comes_back_from_the_middleware_and_a_service(
    run_python: RunPython,
    parts: tuple[Path, ...],
) -> None:
    code = (
        PROVIDE
        + FILL
        + """
import rclpy
from every_kind.srv import Everything
from rclpy.serialization import deserialize_message, serialize_message
Message = load('every_kind/Everything')
for seed in range(50):
    message = fill(Message, random.Random(seed), load)
    assert deserialize_message(serialize_message(message), Message) == message, seed
rclpy.init()
node = rclpy.create_node('everything')

def answer(request, response):
    response.one = request.many[-1]
    return response

node.create_service(Everything, 'everything', answer)
client = node.create_client(Everything, 'everything')
assert client.wait_for_service(60)
many = [fill(Message, random.Random(seed), load) for seed in range(3)]
future = client.call_async(Everything.Request(many=many))
rclpy.spin_until_future_complete(node, future, timeout_sec=60)
print(future.result().one == many[-1])
"""
    )
    run = run_python(code, 'all_parts,more_parts,every_kind', *parts)
    assert run.stdout.splitlines()[-1:] == ['True'], run.stderr


@pytest.mark.long
def test_defaults_and_constants_have_their_values(
    run_python: RunPython,
    parts: tuple[Path, ...],
) -> None:
    code = (
        PROVIDE
        + """
from all_parts.msg import Constants, Defaults
d = Defaults()
print([d.a, d.b, d.c, d.d, d.e, d.f, d.g])
print([d.h, d.i])
print([d.j.tolist(), list(d.k), d.l, d.m, d.n, list(d.o), d.p, list(d.q)])
print([getattr(Constants, name) for name in 'ABCDEFG'])
print([Constants.H, Constants.I])
"""
    )
    run = run_python(code, 'all_parts,more_parts', *parts[:2])
    assert run.stdout.splitlines()[-5:] == [
        "[True, b'\\xc8', 66, -1.5, -9223372036854775808, 18446744073709551615, \"it's é\"]",
        "['äö', 'abc']",
        "[[1, -2], [1.5, 2.0], ['x, y', 'z'], [True], [b'\\x01', b'\\x02'], [1, 2], '', []]",
        "[True, b'\\x07', 66, -1.5, -9223372036854775808, 18446744073709551615, \"it's é\"]",
        "[16, '']",
    ], run.stderr


def test_a_built_package_is_found_and_described_like_an_installed_one(
    run_python: RunPython,
) -> None:
    folder = SHIPPED / 'example_interfaces'
    run = run_python(PROVIDE_AND_LOCATE, 'example_interfaces', folder)
    prefix = Path(run.stdout.splitlines()[-1])
    assert not (prefix / 'build').exists()
    catalogue = InterfaceCatalogue([*ament_prefixes(), prefix])
    name = 'example_interfaces/srv/AddTwoInts'
    assert catalogue.names('srv', 'example_interfaces') == [name]
    description = catalogue.describe(name)
    request = getattr(description, 'request', None)
    assert [(each.name, str(each.type)) for each in getattr(request, 'fields', ())] == [
        ('a', 'int64'),
        ('b', 'int64'),
    ]
    # The official one.
    document = (prefix / 'share' / f'{name}.json').read_text()
    hashes = {
        each['type_name']: each['hash_string'] for each in json.loads(document)['type_hashes']
    }
    assert hashes[name] == (
        'RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a'
    )


SERVER = (
    PROVIDE
    + """
import rclpy
from rclpy.action import ActionServer
from rclpy.executors import ExternalShutdownException
from action_tutorials_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts

def add(request, response):
    response.sum = request.a + request.b
    return response

def compute(goal):
    sequence = [0, 1]
    for _ in range(1, goal.request.order):
        sequence.append(sequence[-1] + sequence[-2])
    goal.publish_feedback(Fibonacci.Feedback(partial_sequence=sequence[:-1]))
    goal.succeed()
    return Fibonacci.Result(sequence=sequence)

rclpy.init()
node = rclpy.create_node('server')
node.create_service(AddTwoInts, 'add', add)
server = ActionServer(node, Fibonacci, 'fibonacci', compute)
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
"""
)
CLIENT = (
    PROVIDE
    + """
import rclpy
from rclpy.action import ActionClient
from action_tutorials_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts

def wait(future):
    rclpy.spin_until_future_complete(node, future, timeout_sec=60)
    return future.result()

rclpy.init()
node = rclpy.create_node('client')
adder = node.create_client(AddTwoInts, 'add')
assert adder.wait_for_service(60)
print(wait(adder.call_async(AddTwoInts.Request(a=2, b=3))).sum)
fibonacci = ActionClient(node, Fibonacci, 'fibonacci')
assert fibonacci.wait_for_server(60)
goal = wait(fibonacci.send_goal_async(Fibonacci.Goal(order=7)))
print(list(wait(goal.get_result_async()).result.sequence))
[feedback] = node.get_publishers_info_by_topic('/fibonacci/_action/feedback')
print(feedback.topic_type_hash)
"""
)


@pytest.fixture
def shipped() -> list[str]:
    names = ['action_tutorials_interfaces', 'example_interfaces']
    return [','.join(names), *(str(SHIPPED / name) for name in names)]


def test_two_processes_talk_by_service_and_action(
    run_python: RunPython,
    start_program: StartProgram,
    shared_cache: Path,
    shipped: list[str],
    domain_id: int,
) -> None:
    environment = process_environment(shared_cache, ROS_DOMAIN_ID=str(domain_id))
    start_program('-c', SERVER, *shipped, env=environment, stdout=None)
    run = run_python(CLIENT, *shipped, ROS_DOMAIN_ID=str(domain_id))
    assert run.stdout.splitlines()[-3:] == [
        '5',
        '[0, 1, 1, 2, 3, 5, 8, 13]',
        'RIHS01_50fc26b9cac313652ecbeab3adf9b5414d59fd4d4d5f9058ddcc7525169927f1',
    ], run.stderr


def build_into(
    folder: Path,
    write: WriteDefinitions,
    files: Mapping[str, str],
    **built: Path,
) -> None:
    folder.mkdir()
    definitions = load_definitions(folder.name, write(files))
    build_package(definitions, folder, Dependencies(ament_prefixes(), built))


def test_a_package_that_is_used_and_not_installed_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DependencyMissingError) as caught:
        Dependencies([tmp_path], {}).locate('action_msgs')
    assert str(caught.value) == "the interface package 'action_msgs' is not installed"
    assert caught.value.help == (
        'install it with ROS: ros-$ROS_DISTRO-action-msgs from apt, or its wheel'
    )


def test_a_compiler_that_fails_is_shown(
    write_definitions: WriteDefinitions,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv('CXX', f'{sys.executable} -c "raise SystemExit(\'an error of mine\')"')
    with pytest.raises(BuildError) as caught:
        build_into(tmp_path / 'robots', write_definitions, {'msg/A.msg': 'int32 a\n'})
    assert 'robots could not be built: compile rosidl_typesupport_' in str(caught.value)
    assert '  an error of mine' in str(caught.value)


def test_a_template_engine_that_does_not_fit_is_named(
    write_definitions: WriteDefinitions,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / 'em.py').write_text("class Interpreter: pass\n__version__ = '4.0'\n")
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    with pytest.raises(BuildError) as caught:
        build_into(tmp_path / 'robots', write_definitions, {'msg/A.msg': 'int32 a\n'})
    expected = f'the module em of version 4.0 ({tmp_path}/em.py) does not fit'
    assert expected in str(caught.value)
