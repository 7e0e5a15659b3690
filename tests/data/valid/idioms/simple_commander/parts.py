import enum
import time

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from lifecycle_msgs.msg import State


class TaskResult(enum.Enum):
    UNKNOWN = 0
    SUCCEEDED = 1
    CANCELED = 2
    FAILED = 3


class BasicNavigator:
    """A facade over the clients of a node."""

    def __init__(self, node, namespace=''):
        self._node, self._goal, self.namespace = node, None, namespace

    def __getattr__(self, name):
        return getattr(self._node.logger, name)

    def wait_until_active(self, tries=10):
        for _ in range(tries):
            response = self._node.call('lifecycle/get_state', {})
            if response.current_state.id == State.PRIMARY_STATE_ACTIVE:
                return True
        return False

    def set_initial_pose(self, x, y):
        msg = PoseWithCovarianceStamped()
        msg.header.frame_id = 'map'
        msg.header.stamp = self._node.now().to_msg()
        msg.pose.pose.position.x, msg.pose.pose.position.y = float(x), float(y)
        msg.pose.covariance = (np.eye(6) * 0.25).ravel()
        self._node.publish('initialpose', msg)

    def go_to(self, seconds):
        self._goal = self._node.send_goal('navigate', {'nested_different_pkg': {'sec': seconds}})

    def is_task_complete(self):
        for self.feedback in self._goal.feedback:
            return False
        return True

    @property
    def result(self):
        return {'succeeded': TaskResult.SUCCEEDED, 'canceled': TaskResult.CANCELED, 'aborted': TaskResult.FAILED}.get(
            str(self._goal.status).lower(), TaskResult.UNKNOWN)


def navigate(node, goal):
    for left in range(goal.nested_different_pkg.sec, 0, -1):
        yield {'nested_different_pkg': {'sec': left}}
        time.sleep(0.01)
    return {'nested_field': {'int32_value': 1}}


def get_state(node, request):
    return {'current_state': State(id=State.PRIMARY_STATE_ACTIVE, label='active')}


def main(node):
    navigator = BasicNavigator(node)
    navigator.set_initial_pose(0, 0)
    if not navigator.wait_until_active():
        return
    for seconds in (3, 5):
        navigator.go_to(seconds)
        while not navigator.is_task_complete():
            navigator.debug(f'{navigator.feedback.nested_different_pkg.sec} s left')
            yield
        node.state.visited += 1
        navigator.info(f'{navigator.result} after {node.state.visited}')
