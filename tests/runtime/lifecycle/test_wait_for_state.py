"""`wait_for: {node: x, state: active}`: of nodes of the system, and of others."""

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetState

pytestmark = pytest.mark.ros

CODE = """
def tell(node):
    node.logger.info('starts')
"""


def test_a_node_starts_when_another_one_is_active(compose, peer):
    text = """
        version: 1
        nodes:
          late:
            wait_for: {node: lidar, state: active}
            on_start: parts:tell
          lidar: {lifecycle: true}
    """
    child = compose(text, CODE)
    peer.change_state('lidar', Transition.TRANSITION_CONFIGURE)
    child.wait_for_line("[late]: Waiting for node '/lidar' to be active")
    assert peer.call(GetState, 'lidar/get_state').current_state.label == 'inactive'
    assert not child.matching('[late]: starts')
    peer.change_state('lidar', Transition.TRANSITION_ACTIVATE)
    child.wait_for_line('[late]: starts')
    child.wait_until_ready()
    assert child.stop() == 0


def test_a_state_that_does_not_come_ends_the_start(compose):
    text = """
        version: 1
        nodes:
          late:
            wait_for: {node: lidar, state: active, timeout: 0.5}
            on_start: parts:tell
          lidar: {lifecycle: true}
    """
    child = compose(text, CODE)
    assert child.wait() == 1
    (line,) = child.matching('error: ')
    assert line.startswith("error: node 'late' (system.yaml:5) waited 0.5 s for the node '/lidar'")
    assert line.endswith('it is unconfigured')
