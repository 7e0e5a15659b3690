"""Values that are read when the system starts: nodes and processes have them, edits read anew."""

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
