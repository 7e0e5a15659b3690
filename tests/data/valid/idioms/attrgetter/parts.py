from functools import reduce
from operator import attrgetter

from nav_msgs.msg import Odometry


def rgetattr(obj, path):
    return reduce(getattr, path.split('.'), obj)


def rsetattr(obj, path, value):
    head, _, tail = path.rpartition('.')
    setattr(rgetattr(obj, head) if head else obj, tail, value)


def odom(node):
    message = Odometry()
    values = {'pose.pose.position.x': 3.0, 'twist.twist.angular.z': -2.0, 'header.stamp': node.now().to_msg(), 'header.frame_id': 'odom', 'child_frame_id': 'base'}
    for path, value in values.items():
        rsetattr(message, path, value)
    return message


def extract(node, message):
    for path in node.parameters.fields:
        node.publish(path.replace('.', '_'), attrgetter(path)(message))


LIMITS = {'twist.twist.angular.z': (-1.0, 1.0), 'pose.pose.position.x': (0.0, 2.0)}


def clamp(node, message):
    for (path, (low, high)) in LIMITS.items():
        rsetattr(message, path, min(high, max(low, rgetattr(message, path))))
    x, w = attrgetter('pose.pose.position.x', 'twist.twist.angular.z')(message)
    node.state.clamped = x, w
    return message
