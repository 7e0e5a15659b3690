"""Servers with a lifecycle and a heartbeat, and the manager that watches them."""

import time

TRANSITIONS = {'configure': 1, 'cleanup': 2, 'activate': 3, 'deactivate': 4}
UP, DOWN = ('configure', 'activate'), ('deactivate', 'cleanup')


class Manager:
    """Brings servers up in their order, and all down when the heartbeat of one is missing."""

    def __init__(self, node):
        self.names = node.parameters.node_names
        self.heartbeats = {}
        self.is_up = False

    def start(self, node, _request):
        self.is_up = all(change_state(node, name, step) for step in UP for name in self.names)
        self.heartbeats = dict.fromkeys(self.names, node.now())
        return {'success': self.is_up}

    def stop(self, node, _request=None):
        self.is_up = False
        names = self.names[::-1]
        return {'success': all(change_state(node, name, step) for step in DOWN for name in names)}

    def tell(self, _node, _request):
        return {'success': self.is_up}

    def hear(self, node, message):
        self.heartbeats[message.data] = node.now()

    def watch(self, node):
        limit_ns = node.parameters.bond_timeout * 1e9
        for name, last in self.heartbeats.items():
            if self.is_up and (node.now() - last).nanoseconds > limit_ns:
                node.logger.error(f'{name} is down')
                self.stop(node)


def change_state(node, name, step):
    return node.call(name, {'transition': {'id': TRANSITIONS[step]}}).success


def configure(node, seconds):
    time.sleep(seconds)
    return not node.parameters.is_broken


def begin(node):
    node.state.begin_ns = node.now().nanoseconds


def beat(node):
    lives_ns = node.parameters.lives_for * 1e9
    is_alive = node.now().nanoseconds - node.state.begin_ns < lives_ns
    return node.ros.get_name() if is_alive else None
