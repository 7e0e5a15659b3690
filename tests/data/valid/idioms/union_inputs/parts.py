from __future__ import annotations

import math
from functools import singledispatch
from typing import Any, Union

from geometry_msgs.msg import Twist, TwistStamped
from std_msgs.msg import Float32

AnyTwist = Union[Twist, TwistStamped]


def feed(node):
    linear = dict(x=0.3)
    node.publish('twist', {'linear': linear})
    node.publish('stamped', {'twist': {'linear': linear}})
    node.publish('number', 0.4)


def normalise(node, message: Twist | TwistStamped | Float32) -> Twist:
    if isinstance(message, TwistStamped):
        message = message.twist
    if not isinstance(message, Twist):
        value = message.data
        message = Twist()
        message.linear.x = value
    speed = math.hypot(message.linear.x, message.linear.y) or 1.0
    message.linear.x /= speed
    message.linear.y /= speed
    return message


@singledispatch
def _linear(message: Any):
    raise TypeError(type(message))


@_linear.register
def _(message: Twist):
    return message.linear


@_linear.register
def _(message: TwistStamped):
    return message.twist.linear


def norm(node, message: AnyTwist) -> float:
    try:
        stamp = message.header.stamp
    except AttributeError:
        stamp = None
    node.state.last = stamp or node.now()
    v = _linear(message)
    return math.sqrt(v.x ** 2 + v.y ** 2)
