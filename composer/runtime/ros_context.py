"""The ROS context of a system, initialized with the arguments of the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.context import Context

from composer.errors import StartError, UsageError
from composer.runtime.reserved_methods import reserve

if TYPE_CHECKING:
    from collections.abc import Sequence


def create_ros_context(ros_arguments: Sequence[str]) -> Context:
    """Return an initialized context, which only the system itself may shut down.

    Args:
        ros_arguments: The arguments after `--ros-args` of the command line.

    Raises:
        UsageError: ROS does not accept them, or they rename all nodes.
        StartError: ROS 2 cannot start.
    """
    context = Context()
    _init(context, ros_arguments)
    reserve(context, 'the context', 'shutdown', 'try_shutdown', 'destroy')
    return context


def _init(context: Context, ros_arguments: Sequence[str]) -> None:
    for argument in ros_arguments:
        if argument.startswith(('__node:=', '__name:=')):
            message = f"'{argument}' would give all nodes of the system one name"
            raise UsageError(message, help=f'name the node that is meant, as in talker:{argument}')
    try:
        context.init(['--ros-args', *ros_arguments] if ros_arguments else [])
    except Exception as error:
        unknown = 'args' in type(error).__name__.lower()
        kind = UsageError if unknown or "Couldn't parse" in str(error) else StartError
        reason = f'it does not know the arguments {error}' if unknown else error
        message = f'ROS 2 cannot start: {reason}'
        raise kind(message) from error
