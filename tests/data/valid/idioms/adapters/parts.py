from __future__ import annotations

import functools

from geometry_msgs.msg import Pose, PoseStamped, Twist, TwistStamped


def unstamped(function):
    """Give a callback the message without its header."""
    @functools.wraps(function)
    def wrapper(node, message):
        inner = next(n for n in message.get_fields_and_field_types() if n != 'header')
        return function(node, getattr(message, inner))
    return wrapper


def stamped(cls):
    """Wrap what a callback returns in a message with a header."""
    field = next(n for n in cls.get_fields_and_field_types() if n != 'header')

    def decorate(function):
        @functools.wraps(function)
        def wrapper(*args):
            message = cls(**{field: function(*args)})
            message.header.stamp = args[0].now().to_msg()
            message.header.frame_id = args[0].parameters.frame
            return message
        return wrapper
    return decorate


def bare(function):
    @functools.wraps(function)
    def wrapper(node, message):
        return function(node, message.data)
    return wrapper


def as_data(function):
    @functools.wraps(function)
    def wrapper(node):
        return {'data': function(node)}
    return wrapper


def success(function):
    @functools.wraps(function)
    def wrapper(node, _request):
        return {'success': function(node), 'message': function.__name__}
    return wrapper


@stamped(TwistStamped)
def make_twist(node) -> Twist:
    twist = Twist()
    twist.linear.x = 0.25
    return twist


@unstamped
def on_twist(node, twist: Twist) -> None:
    node.state.speed = twist.linear.x


@bare
def double(node, value: float) -> float:
    return 2 * value


def make_number(node) -> float:
    return getattr(node.state, 'speed', 0)


@stamped(PoseStamped)
def make_pose(node) -> Pose:
    return Pose()


@as_data
def make_list(node) -> list[int]:
    return [1, 2, 3]


@success
def ready(node) -> bool:
    return hasattr(node.state, 'speed')


def ask(node):
    answer = node.call('ready', {})
    node.logger.debug(f'{answer.message}: {answer.success}')
