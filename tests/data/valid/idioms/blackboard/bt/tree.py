import enum

from .blackboard import recall, remember


class Status(str, enum.Enum):
    SUCCESS = 'success'
    FAILURE = 'failure'
    RUNNING = 'running'


def sequence(*children):
    def run(node):
        for child in children:
            if (status := child(node)) is not Status.SUCCESS:
                return status
        return Status.SUCCESS
    return run


def fallback(*children):
    def run(node):
        for child in children:
            if (status := child(node)) is not Status.FAILURE:
                return status
        return Status.FAILURE
    return run


def condition(test):
    return lambda node: Status.SUCCESS if test(node) else Status.FAILURE


def _charge(node):
    remember(node, charging=node.state.battery < 0.9)
    return Status.RUNNING if node.state.charging else Status.SUCCESS


def _drive(node):
    node.publish('trace', f'{node.state.goal.x:.1f} {node.state.goal.y:.1f} {node.state.goal_time.nanoseconds}')
    return Status.RUNNING


ROOT = fallback(
    sequence(condition(lambda n: n.state.battery < n.parameters.battery_low or n.state.charging), _charge),
    sequence(condition(lambda n: recall(n, 'goal') is not None), _drive),
)


def tick(node):
    node.state.ticks += 1
    return ROOT(node).value
