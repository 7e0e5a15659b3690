"""Parameter files at run time; and rcl, whose reading of them ours is held against."""

import math
import random
import textwrap

import pytest

pytest.importorskip('rclpy')

import rclpy
import rclpy.node
from rcl_interfaces.srv import GetParameters
from rclpy.parameter import Parameter, parameter_value_to_python

from composer.ros_parameters.file_reader import read_parameter_file
from composer.ros_parameters.overrides import find_overrides
from tests.running import reserved_domain

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  arm:
    namespace: robot
    parameter_files: [site.yaml, own.yaml]
    parameters: &parameters
      speed: {default: 1.0, maximum: 5.0, description: In m/s.}
      mode: {default: slow, choices: [slow, fast]}
      gains: [1.0]
      names: [a, b]
      sub.deep: 1
      wheels: {type: integer}
      kept: here
  leg:
    use_sim_time: true
    parameter_files: [site.yaml, others.yaml]
    parameters: *parameters
"""
SITE = """
/**:
  ros__parameters: {speed: 2.0, mode: fast, names: [], undeclared: 1}
/**/arm:
  ros__parameters:
    sub: {deep: 0x10}
    wheels: 3
"""
OWN = """
robot:
  "*":
    ros__parameters: {gains: [.5, inf], mode: slow}
"""
# Of the command line, all for one node.
ASSIGNMENTS = ('leg:wheels:=5', 'leg:speed:=4.0', 'leg:kept:="7"')
OTHERS = """
/**: {ros__parameters: {use_sim_time: false}}
leg: {ros__parameters: {wheels: 4}}
"""
NAMES = ['speed', 'mode', 'gains', 'names', 'sub.deep', 'wheels', 'kept', 'use_sim_time']


def write(folder, **files):
    for name, text in files.items():
        (folder / f'{name}.yaml').write_text(textwrap.dedent(text))


def ask(peer, node, names):
    response = peer.call(GetParameters, f'{node}/get_parameters', names=names)
    return dict(zip(names, map(parameter_value_to_python, response.values), strict=True))


def test_the_command_line_wins_over_files_and_files_over_keys_of_the_node(compose, peer, tmp_path):
    write(tmp_path, site=SITE, own=OWN, others=OTHERS)
    assignments = [part for each in ASSIGNMENTS for part in ('-p', each)]
    child = compose(SYSTEM, '', '--ros-args', *assignments)
    child.wait_until_ready()
    assert ask(peer, '/robot/arm', NAMES) == {
        'speed': 2.0,
        'mode': 'slow',
        'gains': [0.5, math.inf],
        'names': [],
        'sub.deep': 16,
        'wheels': 3,
        'kept': 'here',
        'use_sim_time': False,
    }
    assert ask(peer, '/leg', ['wheels', 'speed', 'kept', 'use_sim_time']) == {
        'wheels': 5,
        'speed': 4.0,
        'kept': '7',
        'use_sim_time': False,
    }
    assert child.stop() == 0
    assert 'undeclared-parameter' in child.output


@pytest.fixture(scope='module')
def context():
    context = rclpy.Context()
    with reserved_domain() as domain:
        rclpy.init(context=context, domain_id=domain)
        yield context
        context.try_shutdown()
        context.destroy()


def load_by_rcl(context, *paths, name='arm', namespace='/robot'):
    """Return what rclpy reads for a node, `None` if rcl refuses a file."""
    node_class = rclpy.node._rclpy.Node
    arguments = [part for path in paths for part in ('--params-file', str(path))]
    profile = getattr(rclpy.qos, 'qos_profile_rosout_default', None)  # Since rclpy 9.
    rosout = [] if profile is None else [profile.get_c_qos_profile()]
    with context.handle:
        try:
            handle = node_class(
                name, namespace, context.handle, ['--ros-args', *arguments], False, False, *rosout
            )
        except rclpy.node._rclpy.RCLInvalidROSArgsError:
            return None
    with handle:
        found = handle.get_parameters(Parameter)
    handle.destroy_when_not_in_use()
    return {name: (each.type_.name, repr(each.value)) for name, each in found.items()}


def load_by_us(*paths, node='/robot/arm'):
    files = [read_parameter_file(path) for path in paths]
    if any(file.findings for file in files):
        return None
    return {
        name: (entry.type.upper(), repr(entry.value)) if entry.type else ('NOT_SET', 'None')
        for name, entry in find_overrides(files, node).items()
    }


WORDS = """
    1 0x1F 010 08 +5 -0 00 1. .5 1E+5 1e400 5e-324 1e-310 -.inf +.inf .nan -.nan inf NaN nan(1) .Inf .iNF
    infinity 0x1.8p3 0x.8 0x1p 0x 0xG 0b1 0o17 1_000 null ~ yes Y off text 1e 1e+ . 5- --5 a.b 12-30
    9223372036854775807 9223372036854775808 -9223372036854775808 -9223372036854775809 0x8000000000000000
    0x1p-1074 0x1p-1075 0x1.8p-1074 2.2250738585072011e-308 1.7976931348623159e308 0e5 "5" 'true' "a\\0b"
"""
SCALARS = WORDS.split()
SCALARS += ['!!str 5', '!!int "5"', '&x 7', '! 5', '"a b"']
PATTERNS = [
    '/**', '/*', '/*/*', '/robot/*', '/robot/**', '/**/arm', 'arm', 'robot/arm', '/robot/arm', '/**/*',
    'leg', '/robot/leg', '**', '*/arm',
]  # fmt: skip


class Writer:
    """Writes parameter files by chance: most are valid, some are not."""

    def __init__(self, seed):
        self._random = random.Random(seed)

    def file(self):
        choose = self._random.choice
        text = ''
        for _ in range(choose([1, 2, 3])):
            # Another document, as ROS allows.
            text += choose(['', '', '', '---\n', '...\n---\n' if text else ''])
            if choose([True, False, False]):
                body = self.parameters(0, ' ' * 6)
                text += f'robot:\n  arm:\n    ros__parameters:\n{body}'
            else:
                body = self.parameters(0, ' ' * 4)
                text += f'"{choose(PATTERNS)}":\n  ros__parameters:\n{body}'
        return text

    def parameters(self, depth, indent):
        text = ''
        for _ in range(self._random.randint(1, 4)):
            key = self._random.choice(['a', 'b', 'c', 'd', 'e.f', '"g h"', '5'])
            if depth < 3 and self._random.random() < 0.2:
                text += f'{indent}{key}:\n{self.parameters(depth + 1, indent + "  ")}'
            else:
                text += f'{indent}{key}: {self.value()}\n'
        return text

    def value(self):
        if self._random.random() < 0.75:
            return self.scalar()
        return f'[{", ".join(self.scalar() for _ in range(self._random.randint(0, 3)))}]'

    def scalar(self):
        if self._random.random() < 0.7:
            return self._random.choice(SCALARS)
        length = self._random.randint(1, 6)
        return ''.join(self._random.choice('0123456789.eExXpP+-abfinAN_') for _ in range(length))


# What rcl reads, and as something else than is written.
STRICTER = ('as a part of it', 'names below it')


def test_files_written_by_chance_are_read_as_rcl_reads_them(context, tmp_path):
    agreed = refused = 0
    for seed in range(60):
        writer = Writer(seed)
        paths = [tmp_path / f'{name}.yaml' for name in 'pq'[: 1 + seed % 2]]
        for path in paths:
            path.write_text(writer.file())
        expected, found = load_by_rcl(context, *paths), load_by_us(*paths)
        if found is None and expected is not None:
            findings = [
                finding for path in paths for finding in read_parameter_file(path).findings
            ]
            assert all(finding.message.endswith(STRICTER) for finding in findings), seed
            continue
        if expected is not None:
            # A name that one file gives a value and another one names below it.
            expected = {
                key: value
                for key, value in expected.items()
                if value[0] != 'NOT_SET' or key in found
            }
        assert found == expected, f'seed {seed}'
        agreed += expected is not None
        refused += expected is None
    assert agreed > 10
    assert refused > 10
