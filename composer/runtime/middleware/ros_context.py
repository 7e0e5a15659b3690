"""The ROS context of a system: how it joins the ROS graph, and leaves it when the process ends."""

from __future__ import annotations

import ctypes
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.context import Context

from composer.errors import StartError, UsageError
from composer.runtime.middleware.shared_memory import remove_left_segments
from composer.runtime.reserved_methods import reserve

if TYPE_CHECKING:
    from collections.abc import Sequence

# Fast DDS 2 of Jazzy, and 3 of Kilted: "shuts down all participants, readers and writers".
_STOP_ALL = {
    'libfastrtps': '_ZN8eprosima8fastrtps4rtps10RTPSDomain7stopAllEv',
    'libfastdds': '_ZN8eprosima7fastdds4rtps10RTPSDomain7stopAllEv',
}


class _SystemContext(Context):
    """A context whose nodes the system destroys."""

    def track_node(self, node: Any) -> None:
        """Do not destroy `node` at the shutdown, as rclpy does since version 9."""


def create_ros_context(ros_arguments: Sequence[str]) -> Context:
    """Return an initialized context, which only the system itself may shut down.

    Args:
        ros_arguments: The arguments after `--ros-args` of the command line.

    Raises:
        UsageError: ROS does not accept them, or they rename all nodes.
        StartError: ROS 2 cannot start.
    """
    remove_left_segments()
    context = _SystemContext()
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


def leave_graph_at_exit(context: Context, nodes: Any) -> bool:
    """Have the process leave the ROS graph as a whole when it exits.

    To destroy one node after the other takes time that grows with the square of their number: for
    each entity the middleware looks at all others. When it shuts down as a whole it does not, and
    tells all peers at once. After that nothing may use it: the process ends there, with the exit
    code that it exits with, after all `atexit` functions of Python.

    Args:
        nodes: They are not destroyed any more, whatever Python does.

    Returns:
        Whether it does. It is known of Fast DDS, and of the C library GNU's.
    """
    stop_all, libc = find_stop_all(), ctypes.CDLL(None)
    if stop_all is None or not hasattr(libc, 'on_exit'):
        return False
    for each in (context, nodes):
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(each))
    # Else its shutdown destroys the publishers of `/rosout`, one after the other.
    context._logging_initialized = False  # noqa: SLF001 - the only way
    # The last one is called first, the first one with the exit code.
    for function in (libc._exit, libc.fcloseall, stop_all):  # noqa: SLF001 - a name of C
        libc.on_exit(function, None)
    return True


def find_stop_all() -> Any:
    """Return the function of Fast DDS that shuts it down; `None` if ROS does not use it."""
    found = re.search(r'/\S*/(libfastrtps|libfastdds)\.so\S*', Path('/proc/self/maps').read_text())
    # As in `PyDLL`: while it runs, no other thread may use what it shuts down.
    return found and getattr(ctypes.PyDLL(found[0]), _STOP_ALL[found[1]], None)
