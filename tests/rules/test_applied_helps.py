"""What people write by habit is an error whose help names what to write, and that works."""

from pathlib import Path

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from tests.rules.applied_helps import apply, read_help


def check(path):
    return check_system(load_system(path), InterfaceCatalogue())


# What somebody writes first who knows ROS and YAML: with what is to be written instead, if that
# is a text for the marked place.
NODE = 'version: 1\nargs: {mode: sim}\nnodes:\n  n:\n    '
PARAMETER_FILE = 'n:\n  ros__parameters:\n    footprint: [[0.3, 0.2]]\n'
HABITS = {
    'timers: {t: {period: 100ms, publish: p}}': 'write 0.1',
    'timers: {t: {rate: 10 Hz, publish: p}}': 'write 10',
    'timers: {t: {rate: "5", publish: p}}': 'write 5',
    'timers: {t: {period: 10Hz, publish: p}}': None,
    'timers: {t: {rate: 10ms, publish: p}}': None,
    'parameters: {gains: {p: 1.0}}': 'write gains.p: 1.0',
    'parameters: {gains: {defualt: 1.0}}': "did you mean 'default'?",
    'parameters: {a: [[1, 2], [3]]}': 'write one flat list, or a text in quotes',
    'parameters: {a: [{id: 1}]}': 'write a list for each of their keys',
    'parameter_files: [p.yaml]': 'write one flat list, or a text in quotes',
    '''when: "{{ env('NO_SUCH', 'false') }}"''': "write {{ env('NO_SUCH', 'false') | bool }}",
    'when: "{{ mode }}"': 'compare it: {{ mode == … }}',
    'when: "yes"': 'write true',
    'when: 0': 'write false',
    '''when: "mode == 'sim'"''': '''write "{{ mode == 'sim' }}"''',
    'namespace: amr-07.local/': "did you mean '/amr_07_local'?",
    'subscriptions: {my-scan: {type: std_msgs/msg/String}}': "did you mean 'my_scan'?",
    'publishers: {o: String}': "did you mean 'std_msgs/msg/String'?",
    'services: {o: {type: srv/SetBool}}': "did you mean 'std_srvs/srv/SetBool'?",
    'publishers: {o: Nothing}': "'composer interfaces list' shows the types",
    'publishers: {o: {type: std_msgs/msg/String, qos: 0}}': 'write 1',
    'publishers: {o: {type: std_msgs/msg/String, qos: {depth: 0}}}': 'write 1',
    'publishers: {o: {type: std_msgs/msg/Header}}\n    timers: {t: {rate: 1, publish: o, '
    'message: {stamp: now}}}': 'give its fields by name: sec, nanosec; only a behaviour knows the '
    "time, as in {'stamp': node.now()}",
    'description: %d': 'put a value that begins with it in quotes',
    'parameters: {format: @d, z: 1}': 'put a value that begins with it in quotes',
    'description: [a\n    parameters: {z: 1}': "close the bracket with ']'",
    'parameters: {a: [1, 2}': "close the bracket with ']'",
    'description: a: b': "put a value that contains ': ' in quotes",
    'parameters: {a: 1 b: 2}': "put a comma between entries, and a value that contains ': ' in "
    'quotes',
    "description: 'it's'": "put all of the value in quotes, and write '' for a ' in it",
    'description: - a': 'write the list as [a, b]',
    'timers:\n      t: {rate: 1}\n     u: {rate: 2}': 'indent all keys of a mapping alike',
}
ARGUMENTS = "write it under 'vars:', or split a text: {{ names.split(',') }}"


@pytest.mark.ros
@pytest.mark.parametrize(('written', 'said'), HABITS.items(), ids=range(len(HABITS)))
def test_a_habit_is_an_error_with_what_to_write(tmp_path, monkeypatch, written, said):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv('NO_SUCH', raising=False)
    Path('p.yaml').write_text(PARAMETER_FILE)
    Path('bad.yaml').write_text(f'{NODE}{written}\n')
    findings = check(Path('bad.yaml'))
    helps = {finding.help: finding for finding in findings}
    assert said in helps
    if (edit := read_help(helps[said])) is not None and not said.startswith('write gains'):
        apply(helps[said], *edit)
        assert said not in {finding.help for finding in check(Path('bad.yaml'))}


@pytest.mark.parametrize('given', ['[a, b]', '{default: [a]}', '{default: {a: 1}}'])
def test_an_argument_that_is_a_list_is_told_where_lists_are(tmp_path, given):
    path = tmp_path / 'system.yaml'
    path.write_text(f'version: 1\nargs: {{names: {given}}}\nnodes: {{}}\n')
    assert ARGUMENTS in {finding.help for finding in check(path)}


# What somebody writes in a behaviour who knows rclpy, with what is written instead.
OF_RCLPY = {
    "node.get_logger().info('x')": 'write node.logger',
    "print(node.get_parameter('speed').value)": 'write node.parameters.NAME',
    "node.declare_parameter('speed', 1.0)": "declare it under 'parameters:' of the node",
    'print(node.get_name())': 'write node.name',
    'print(node.get_clock().now())': 'write node.now()',
    'print(node.count_publishers("/x"))': "did you mean 'ros.count_publishers'?",
    'print(node.nmae)': "did you mean 'name'?",
    'print(message.K)': "did you mean 'k'?",
    'await asyncio.sleep(1)': 'call time.sleep, in a group of its own; in a timer, write a '
    'generator',
    'rclpy.spin_once(node)': 'wait with node.call, node.send_goal, await or node.sleep',
    'rclpy.spin_until_future_complete(node.ros, message)': 'wait with node.call, node.send_goal, '
    'await or node.sleep',
}
HEARING = """version: 1
nodes:
  n:
    parameters: {speed: 1.0}
    subscriptions:
      info: {type: sensor_msgs/msg/CameraInfo, external: true, behaviour: 'habits:Ear.hear'}
"""


@pytest.mark.ros
@pytest.mark.parametrize(('line', 'said'), OF_RCLPY.items(), ids=range(len(OF_RCLPY)))
def test_a_habit_of_rclpy_is_an_error_with_what_to_write(tmp_path, monkeypatch, line, said):
    monkeypatch.chdir(tmp_path)
    Path('habits.py').write_text(
        'import asyncio\nimport rclpy\n\n\n'
        f'class Ear:\n    async def hear(self, node, message):\n        {line}\n'
    )
    Path('bad.yaml').write_text(HEARING)
    (finding,) = (each for each in check(Path('bad.yaml')) if each.file == 'habits.py')
    assert finding.help.partition(' its fields')[0] == said
    if said.startswith('did you mean'):
        apply(finding, *read_help(finding))
        assert 'habits.py' not in {each.file for each in check(Path('bad.yaml'))}
