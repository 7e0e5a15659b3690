import random
from enum import Enum

from geometry_msgs.msg import TwistStamped


class Topic(str, Enum):
    ERROR_X = 'err_x'
    ERROR_Y = 'err_y'

    def __str__(self):
        return self.value


AXES = {'x': {'out': 'cmd_' + 'x', 'gain': 'kp_x'}, 'y': {'out': '_'.join(['cmd', 'y']), 'gain': 'kp_y'}}


def errors(node):
    for topic in Topic:
        node.publish(topic.value, random.random())


def control(node, message, axis):
    row = AXES[axis]
    if node.parameters.get(axis + '_enabled'):
        command = getattr(node.parameters, row['gain']) * message.data
        node.publish(row['out'], command)
        setattr(node.state, row['out'], command)


def twist(node):
    out = TwistStamped()
    out.header.frame_id = node.parameters.frame
    for axis, row in AXES.items():
        if (value := getattr(node.state, row['out'], None)) is not None:
            setattr(out.twist.linear, axis, value)
    return out if any(hasattr(node.state, row['out']) for row in AXES.values()) else None
