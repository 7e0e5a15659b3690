import time
from functools import partial

from composer import GoalRejectedError


def enable(node, request):
    node.state.enabled = request.data
    return {'success': True, 'message': f'{node.state.enabled=}'}


def stop(node, request):
    enabled = getattr(node.state, 'enabled', False)
    node.state.enabled = False
    return (enabled, '')[0] and {'success': True} or {'message': 'was off'}


def may_spin(node, goal):
    return getattr(node.state, 'enabled', False) or 'motors are off'


def spin(node, goal):
    turns = []
    for turn in range(goal.order):
        if not node.state.enabled:
            break
        turns.append(turn)
        time.sleep(0.01)
        yield {'sequence': turns}
    return {'sequence': turns}


class Step:
    """A step of the supervisor: a client, what to send, and how to read the answer."""

    def __init__(self, method, name, payload, read=lambda answer: answer.success):
        self.method, self.arguments, self.read = method, (name, payload), read

    def __call__(self, node):
        try:
            return f'{self.arguments[0]}: {self.read(getattr(node, self.method)(*self.arguments))}'
        except GoalRejectedError as error:
            return f'{self.arguments[0]}: {error.__class__.__name__}'


Call, Goal = partial(Step, 'call'), partial(Step, 'send_goal', read=lambda goal: len(goal.result(timeout=2).sequence))
STEPS = [Goal('spin', 3), Call('enable', True), Goal('spin', {'order': 4}), Call('stop', {}), Call('stop', {})]


def run(node):
    step = STEPS[node.state.step % len(STEPS)]
    node.state.step += 1
    return step(node)
