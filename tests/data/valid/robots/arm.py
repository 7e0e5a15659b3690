import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field

LOCK = threading.Lock()


@dataclass
class Arm:
    names: list[str]
    positions: list[float] = field(default_factory=list)

    def __post_init__(self):
        self.positions = [0.0] * len(self.names)

    def move(self, index, target, step):
        difference = target - self.positions[index]
        self.positions[index] += max(-step, min(step, difference))
        return abs(target - self.positions[index]) < 1e-3

    @property
    def is_home(self):
        return all(abs(each) < 1e-3 for each in self.positions)


@contextmanager
def held(node):
    with LOCK:
        yield node.state.arm


def begin(node):
    node.state.arm = Arm(node.parameters.joints)
    node.logger.info(f'{len(node.state.arm.names)} joints')


def report(node):
    with held(node) as arm:
        return {
            'header': {'stamp': node.now(), 'frame_id': 'base'},
            'name': arm.names,
            'position': list(arm.positions),
        }


def may_reach(node, goal):
    if not 0 <= goal.order < len(node.parameters.joints):
        return f'there is no joint {goal.order}'
    return True


def reach(node, goal):
    sequence = []
    for target in (0.2, 0.4, 0.6):
        while not move(node, goal.order, target):
            yield
        sequence.append(int(target * 10))
        yield sequence
    return {'sequence': sequence}


def move(node, index, target):
    with LOCK:
        return node.state.arm.move(index, target, node.parameters.velocity * 0.05)


def home(node, request):
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline:
        with LOCK:
            if node.state.arm.is_home:
                return {'success': True}
            for index in range(len(node.state.arm.names)):
                node.state.arm.move(index, 0.0, 0.05)
        if not node.sleep(0.05):
            break
    return {'success': False, 'message': 'it takes too long'}


def park(node):
    node.logger.info('parked')
