"""`environment:` holds for ROS, for behaviours and for external processes, and is restored at the end."""

from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.application.output import wants_colour
from composer.checks.environment import find_environment_problems
from composer.errors import StartError
from composer.runtime.environment import (
    check_log_folder,
    check_middleware,
    check_shell,
    find_colour,
)

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]
CODE = """
import os

print('imported in', os.environ.get('ROS_DOMAIN_ID'), os.environ.get('MODE'), flush=True)

def tell(node):
    node.logger.info(f'domain {node.ros.context.get_domain_id()}')
    node.shutdown()
"""
SYSTEM = """
version: 1
environment: {{ROS_DOMAIN_ID: {domain}, MODE: fast, RCUTILS_CONSOLE_OUTPUT_FORMAT: '<{{message}}>'}}
nodes: {{n: {{timers: {{t: {{period: 0.5, behaviour: 'parts:tell'}}}}}}}}
processes: {{driver: {{command: [sh, -c, 'echo "$ROS_DOMAIN_ID $MODE"']}}}}
"""


def test_variables_hold_for_ros_behaviours_and_processes(compose, other_domain_id):
    child = compose(SYSTEM.format(domain=other_domain_id), CODE)

    assert child.wait() == 0
    assert f'imported in {other_domain_id} fast' in child.lines
    assert f'[driver] {other_domain_id} fast' in child.lines
    # The form of the log shows that it was set before ROS was loaded.
    assert f'<domain {other_domain_id}>' in child.lines


ADDER = """
import rclpy
from example_interfaces.srv import AddTwoInts

rclpy.init()
node = rclpy.create_node('peer')
client = node.create_client(AddTwoInts, 'add')
client.wait_for_service()
future = client.call_async(AddTwoInts.Request(a=40, b=2))
rclpy.spin_until_future_complete(node, future)
print('sum', future.result().sum, flush=True)
"""
FINDER = """
import os
import example_interfaces

prefix, place = os.environ['AMENT_PREFIX_PATH'].split(':')[0], os.environ['PYTHONPATH']
print(place.replace(prefix, 'PREFIX'), os.environ['LD_LIBRARY_PATH'].startswith(f'{prefix}/lib'))
"""
WITH_INTERFACES = f"""
version: 1
interfaces: {{example_interfaces: {ROOT}/interfaces/example_interfaces}}
nodes:
  adder: {{services: {{add: {{type: example_interfaces/srv/AddTwoInts, behaviour: 'parts:add'}}}}}}
processes:
  peer: {{command: [python3, peer.py], cwd: .}}
  finder: {{command: [python3, finder.py], cwd: ., env: {{PYTHONPATH: /own}}}}
"""
ADD = """
from ament_index_python.packages import get_package_prefix

def add(node, request):
    node.logger.info(f'it is in {get_package_prefix("example_interfaces")}')
    return request.a + request.b
"""


def test_processes_and_behaviours_find_the_interfaces_of_the_system(compose, interface_cache):
    (compose.folder / 'peer.py').write_text(ADDER)
    (compose.folder / 'finder.py').write_text(FINDER)
    child = compose(WITH_INTERFACES, ADD)

    child.wait_for_line('[peer] sum 42')
    child.wait_for_line('[finder] PREFIX/python:/own True')
    child.wait_for_line(f'it is in {interface_cache}/composer/interfaces/example_interfaces-')
    assert child.stop() == 0


def test_another_middleware_than_the_one_loaded_before_is_said():
    from rclpy.utilities import get_rmw_implementation_identifier

    loaded = get_rmw_implementation_identifier()
    check_middleware({'RMW_IMPLEMENTATION': loaded})
    check_middleware({})
    with pytest.raises(StartError) as caught:
        check_middleware({'RMW_IMPLEMENTATION': 'rmw_other_cpp'})

    assert str(caught.value) == (
        f"RMW_IMPLEMENTATION is 'rmw_other_cpp', but this process has loaded '{loaded}' before"
    )
    assert caught.value.help == 'a process has one middleware: run this system in another'


UNUSABLE = {
    ('ROS_DOMAIN_ID', '300'): "ROS_DOMAIN_ID is a number from 0 to 232, not '300'",
    (
        'RMW_IMPLEMENTATION',
        'rmw_none',
    ): "RMW_IMPLEMENTATION: no middleware 'rmw_none' is installed",
    ('ROS_SECURITY_ENABLE', 'yes'): "ROS_SECURITY_ENABLE is true or false, not 'yes'",
    ('FASTDDS_BUILTIN_TRANSPORTS', 'UDP?max_msg_size=1MB'): (
        'FASTDDS_BUILTIN_TRANSPORTS is DEFAULT or DEFAULTv6 or LARGE_DATA or LARGE_DATAv6 or '
        "NONE or P2P or SHM or UDPv4 or UDPv6, not 'UDP?max_msg_size=1MB'"
    ),
    ('ROS_STATIC_PEERS', 'x' * 256): 'a peer in ROS_STATIC_PEERS has at most 255 characters',
}


@pytest.mark.parametrize(('name', 'value'), UNUSABLE)
def test_variables_of_the_shell_are_checked_as_those_of_the_file(monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    with pytest.raises(StartError) as caught:
        check_shell({})
    assert str(caught.value) == f'{UNUSABLE[name, value]} (as the shell has set it)'
    (problem,) = find_environment_problems({name: value})
    assert problem[:2] == (name, UNUSABLE[name, value])


@pytest.mark.parametrize(
    ('variables', 'folder', 'problem'),
    [
        ({'ROS_LOG_DIR': '/proc/new'}, "'/proc/new' (ROS_LOG_DIR)", 'No such file or directory'),
        ({'HOME': 'file'}, "'~/.ros/log' (HOME)", 'Not a directory'),
    ],
)
def test_a_folder_for_the_log_that_cannot_be_is_an_error(
    monkeypatch, tmp_path, variables, folder, problem
):
    monkeypatch.chdir(tmp_path)
    Path('file').touch()
    for name in ('ROS_LOG_DIR', 'ROS_HOME', 'HOME'):
        monkeypatch.setenv(name, variables.get(name, ''))
    with pytest.raises(StartError) as caught:
        check_log_folder([])
    assert str(caught.value) == f'ROS cannot keep its log files in {folder}: {problem}'
    check_log_folder(['--disable-external-lib-logs'])


def test_a_wrong_variable_is_an_error_before_anything_starts(compose, monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'subnet')
    child = compose(SYSTEM.format(domain=1), CODE)

    assert child.wait() == 1
    assert child.lines == [
        'error: ROS_AUTOMATIC_DISCOVERY_RANGE is SUBNET or LOCALHOST or OFF or SYSTEM_DEFAULT, '
        "not 'subnet' (as the shell has set it)",
        "  help: did you mean 'SUBNET'?",
    ]


@pytest.mark.parametrize(
    ('variables', 'colour'),
    [
        ({'FORCE_COLOR': '1', 'TERM': 'dumb'}, True),
        ({'FORCE_COLOR': '1', 'NO_COLOR': '1'}, False),
        ({'TERM': 'dumb'}, False),
        ({'TERM': 'xterm'}, None),
    ],
)
def test_the_log_has_colours_as_the_shell_asks_for(monkeypatch, variables, colour):
    for name in ('FORCE_COLOR', 'NO_COLOR', 'TERM', 'RCUTILS_COLORIZED_OUTPUT'):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    expected = {} if colour is None else {'RCUTILS_COLORIZED_OUTPUT': str(int(colour))}
    assert find_colour() == expected
    assert wants_colour() == bool(colour)
    monkeypatch.setenv('RCUTILS_COLORIZED_OUTPUT', '1')
    assert find_colour() == {}
