import math

from geometry_msgs.msg import Twist

AXES = [('linear', 'x'), ('angular', 'z')]


def command(node):
    fast = node.own_state['fast'] = not node.own_state.get('fast', False)
    return {'linear': {'x': 3.0 * fast}, 'angular': {'z': -1 + 2 * fast}}


def target(node, message):
    node.state.target = {axis: getattr(getattr(message, axis[0]), axis[1]) for axis in AXES}


def _approach(current, goal, step):
    return current + math.copysign(min(abs(goal - current), step), goal - current)


def smooth(node):
    if (target := getattr(node.state, 'target', None)) is None:
        return None
    current = node.own_state.setdefault('current', dict.fromkeys(AXES, 0.0))
    out = Twist()
    for kind, axis in AXES:
        limit, rate = getattr(node.parameters, f'limits.{kind}.{axis}')
        goal = max(-limit, min(limit, target[kind, axis]))
        current[kind, axis] = _approach(current[kind, axis], goal, rate / 50)
        vector = getattr(out, kind)
        vector.__setattr__(axis, current[(kind, axis)])
    return out
