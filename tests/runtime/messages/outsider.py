"""A plain rclpy process beside a system, whose subscriptions and publishers come and go."""

import json
import os
import queue
import subprocess
import sys
import threading
from time import monotonic, sleep

from tests.running import DEADLINE_SEC, ROOT, read_line

_POLL_SEC = 0.002
_MOST_AT_ONCE = 20


class Outsider:
    """The process; each method returns when it has been done there."""

    def __init__(self, domain_id):
        self._process = subprocess.Popen(
            [sys.executable, '-m', __name__],
            cwd=ROOT,
            env=os.environ | {'ROS_DOMAIN_ID': str(domain_id)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def join(self, name, topic, qos, *, has_context=False):
        """Subscribe to a topic of strings, in a context of its own if `has_context`."""
        self._do('join', name, topic, qos, has_context)

    def heard(self, name, least=0):
        """Return what a subscription got: texts with their sequence numbers.

        Args:
            least: How many to wait for.
        """
        return [tuple(each) for each in self._do('heard', name, least)]

    def leave(self, name):
        """Destroy a subscription."""
        self._do('leave', name)

    def advertise(self, name, topic, qos):
        """Create a publisher."""
        self._do('advertise', name, topic, qos)

    def subscriptions(self, name):
        """Return how many subscriptions a publisher has met."""
        return self._do('subscriptions', name)

    def publish(self, name, texts):
        """Publish texts."""
        self._do('publish', name, texts)

    def close(self):
        """End it."""
        self._process.stdin.close()
        self._process.wait(DEADLINE_SEC)
        self._process.stdout.close()

    def _do(self, *command):
        self._process.stdin.write(json.dumps(command) + '\n')
        self._process.stdin.flush()
        return json.loads(read_line(self._process.stdout))


class _Ends:
    """What there is in the process; its methods are the commands."""

    def __init__(self):
        self._shared = _Place()
        self._places = {}
        self._ends = {}
        self._heard = {}

    def spin(self):
        """Take what has come, of each subscription in turn."""
        before = sum(map(len, self._heard.values()))
        for place in [self._shared, *self._places.values()]:
            for _ in range(_MOST_AT_ONCE):
                place.executor.spin_once(0)
        if before == sum(map(len, self._heard.values())):
            sleep(_POLL_SEC)

    def join(self, name, topic, qos, has_context):
        from std_msgs.msg import String

        heard = self._heard[name] = []
        if has_context:
            self._places[name] = _Place()
        place = self._places.get(name, self._shared)

        def hear(message, info):
            heard.append((message.data, info['publication_sequence_number']))

        self._ends[name] = place.node.create_subscription(String, topic, hear, _profile(qos))

    def heard(self, name, least):
        deadline = monotonic() + DEADLINE_SEC
        while len(self._heard[name]) < least and monotonic() < deadline:
            self.spin()
        return self._heard[name]

    def leave(self, name):
        place = self._places.pop(name, None)
        subscription = self._ends.pop(name)
        if place is None:
            self._shared.node.destroy_subscription(subscription)
        else:
            place.close()

    def advertise(self, name, topic, qos):
        from std_msgs.msg import String

        self._ends[name] = self._shared.node.create_publisher(String, topic, _profile(qos))

    def subscriptions(self, name):
        return self._ends[name].get_subscription_count()

    def publish(self, name, texts):
        from std_msgs.msg import String

        for text in texts:
            self._ends[name].publish(String(data=text))


class _Place:
    """A node in a context of its own."""

    def __init__(self):
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = rclpy.create_node('outsider', context=self._context)
        self.executor = SingleThreadedExecutor(context=self._context)
        self.executor.add_node(self.node)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()


def _profile(policies):
    from composer.language.specs import QosSpec
    from composer.runtime.messages.qos_profiles import create_qos_profile

    return create_qos_profile(QosSpec('default', policies, ()), {})


def _serve():
    commands = queue.SimpleQueue()

    def read():
        for line in sys.stdin:
            commands.put(json.loads(line))
        commands.put(None)

    threading.Thread(target=read).start()
    ends = _Ends()
    while True:
        ends.spin()
        while not commands.empty():
            command = commands.get()
            if command is None:
                return
            result = getattr(ends, command[0])(*command[1:])
            sys.stdout.write(json.dumps(result) + '\n')
            sys.stdout.flush()


if __name__ == '__main__':
    _serve()
