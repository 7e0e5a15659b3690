"""A node that no edit names: what it has begun passes through all of them."""

from rclpy.parameter import Parameter

from tests.running import wait_for

WITNESS = '/witness'


class Witness:
    """Messages, a call, a goal and values that wait in the node until the end."""

    def __init__(self, system, observer):
        self._node, self._observer = system._nodes[WITNESS], observer
        self._ros = self._node.ros
        self._ros.set_parameters([Parameter('level', value=7)])
        observer.publish('/held', 'std_msgs/msg/Int64', data=-1)
        wait_for(lambda: observer.count_subscriptions('/held', 'std_msgs/msg/Int64'), 'a match')
        for number in range(5):
            observer.publish('/held', 'std_msgs/msg/Int64', data=number)
        self._response = observer.begin_call('/slow', 'std_srvs/srv/Trigger')
        self._result = observer.send_goal('/long', 'test_msgs/action/Fibonacci', order=42)

    def release(self):
        """Let what it does come to its end."""
        self._node.behaviour_node.state.released = True

    def check(self):
        """See that nothing was lost."""
        state = self._node.behaviour_node.state
        self.release()
        wait_for(lambda: state.held[-5:] == list(range(5)), 'all messages that were held')
        assert self._observer.wait(self._response).message == 'released'
        assert list(self._observer.wait(self._result).result.sequence) == [42]
        wait_for(lambda: state.heard_afar, 'messages of a worker')
        for heard in (list(state.heard), list(state.heard_afar)):
            assert heard == list(range(heard[0], heard[0] + len(heard)))
        assert self._node.behaviour_node.parameters.level == 7
        assert self._node.ros is self._ros
