"""Values that are read when the system starts: nodes and processes have them, edits read anew."""

import sys

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
def tell(node):
    node.logger.info(f'is {node.parameters.description.strip()}, {node.parameters.speed}')
"""
SYSTEM = """
version: 1
args: {side: {command: [echo, left]}}
nodes:
  n:
    parameters:
      description: {command: [cat, "{{ here }}/arm.urdf"]}
      speed: {file: limits.yaml, key: speed, type: double, maximum: 5.0}
    timers: {t: {period: 0.05, behaviour: parts:tell}}
processes:
  p:
    command: [sh, -c, 'echo "$SIDE $SPEED"; sleep 60']
    env: {SIDE: "{{ side }}", SPEED: {file: limits.yaml, key: speed}}
"""


def test_values_are_there_at_the_start_and_change_with_their_files(compose, tmp_path):
    (tmp_path / 'arm.urdf').write_text('<one/>\n')
    limits = tmp_path / 'limits.yaml'
    limits.write_text('speed: 2.5\n')
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_for_line('is <one/>, 2.5')
    child.wait_for_line('[p] left 2.5')
    (tmp_path / 'arm.urdf').write_text('<two/>\n')
    child.wait_for_line('is <two/>, 2.5')
    limits.write_text('speed: 4.5\n')
    child.wait_for_line('is <two/>, 4.5')
    child.wait_for_line('[p] left 4.5')
    (tmp_path / 'arm.urdf').write_text('')
    child.wait_for_line("'cat' has printed nothing")
    assert child.stop() == 0


PROGRAM = """
import signal
signal.signal(signal.SIGINT, signal.SIG_DFL)
import rclpy
rclpy.init()
node = rclpy.create_node('arm', automatically_declare_parameters_from_overrides=True)
values = node.get_parameters_by_prefix('')
told = {name: each.value for name, each in sorted(values.items()) if name in 'frame rate list'}
print(node.get_fully_qualified_name(), told, flush=True)
signal.pause()
"""
WITH_FILES = """
version: 1
args: {robot: left, rate: 2.0}
vars: {list: ["{{ robot }}", "010"]}
processes:
  p:
    command: [PYTHON, "{{ here }}/program.py"]
    namespace: "{{ robot }}"
    nodes: [arm]
    parameter_files: [{file: p.yaml, expressions: true, root: "{{ robot }}"}, q.yaml]
"""
FILE = """
arm:
  ros__parameters: {frame: "{{ robot }}_base", rate: "{{ rate * 2 }}", list: "{{ list }}"}
"""


def test_a_process_reads_its_parameter_file_with_the_values_of_the_system(compose, tmp_path):
    (tmp_path / 'program.py').write_text(PROGRAM)
    (tmp_path / 'p.yaml').write_text(FILE)
    # What it says of the same wins.
    (tmp_path / 'q.yaml').write_text('/left/arm:\n  ros__parameters: {rate: 5.0}\n')
    text = WITH_FILES.replace('PYTHON', sys.executable)
    child = compose(text, '', '--watch')
    child.wait_for_line(
        "[p] /left/arm {'frame': 'left_base', 'list': ['left', '010'], 'rate': 5.0}"
    )
    path = tmp_path / 'system.yaml'
    path.write_text(text.replace(', q.yaml', '').replace('"010"', 'yes'))
    child.wait_for_line(
        "[p] /left/arm {'frame': 'left_base', 'list': ['left', 'yes'], 'rate': 4.0}"
    )
    assert child.stop() == 0


def test_a_system_whose_command_fails_does_not_start(compose, tmp_path):
    (tmp_path / 'limits.yaml').write_text('speed: 2.5\n')
    child = compose(SYSTEM, CODE)
    assert child.wait() == 1
    assert (
        "system.yaml:7:20: parameter 'description' of node 'n': 'cat' has ended with"
        in child.output
    )
    assert 'No such file or directory' in child.output
    assert 'ready' not in child.output
