from . import blackboard
from .blackboard import remember as keep


def on_battery(node, message):
    keep(node, battery=message.data)


def on_goal(node, message):
    keep(node, **{'goal': message, 'goal_time': node.now()})


def drain(node):
    level = blackboard.recall(node, 'battery', 1.0)
    return min(1.0, level + 0.2) if node.state.charging else max(0.0, level - 0.05)


def goals(node):
    from random import uniform
    return {axis: uniform(-1, 1) for axis in 'xy'}
