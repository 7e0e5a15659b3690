"""What is found in a module that imports all names of another one, and where types are asked for."""

from filling import *  # noqa: F403
from geometry_msgs.msg import Twist


def march(node):
    leg = Leg(1.0)  # noqa: F405
    leg.fly()  # error
    for each in node.own_state.get('steps', []):
        if isinstance(each, float):
            _drive(node, each)


def _drive(node, speed):
    twist = Twist()
    twist.linear = node.now()  # error
    twist.linear.x = speed
    node.publish('cmd', twist)
