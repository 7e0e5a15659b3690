"""Commands on their way to the wheels: smoothed, and stopped before obstacles."""

from math import inf


def is_older(node, time, seconds):
    return time is None or (node.now() - time).nanoseconds >= seconds * 1e9


class Smoother:
    """Limits accelerations, and stops when commands stop."""

    def __init__(self):
        self.command = self.last = 0.0
        self.heard = None

    def hear(self, node, message):
        self.command, self.heard = message.linear.x, node.now()

    def smooth(self, node):
        own = node.parameters
        if is_older(node, self.heard, own.timeout):
            if self.command == self.last == 0.0:
                return None
            self.command = 0.0
        step = own.acceleration / own.rate
        self.last = max(self.last - step, min(self.last + step, self.command, own.maximum))
        # What is held back does not count: the next step goes on from where this one is.
        return {'linear': {'x': self.last if self.last >= own.deadband else 0.0}}


class CollisionMonitor:
    """Slows commands down, or stops them, as the nearest point says; a silent source stops."""

    def __init__(self):
        self.nearest, self.heard, self.state = inf, None, ''

    def scan(self, node, message):
        self.nearest, self.heard = min(message.ranges, default=inf), node.now()

    def limit(self, node, message):
        state, factor = self._judge(node)
        if state != self.state:
            self.state = state
            node.publish('state', state)
        return {'linear': {'x': message.linear.x * factor}}

    def _judge(self, node):
        own = node.parameters
        if is_older(node, self.heard, own.source_timeout):
            return 'invalid source', 0.0
        if self.nearest <= own.stop_distance:
            return 'stop', 0.0
        return ('slowdown', 0.5) if self.nearest <= own.slow_distance else ('free', 1.0)
