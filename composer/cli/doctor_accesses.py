"""What Composer uses beside the documented interfaces of ROS and Python, each with a probe."""

from __future__ import annotations

import ctypes
import subprocess
import threading
from typing import TYPE_CHECKING, Any

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@record
class Access:
    """One access.

    Attributes:
        probe: Given a node of rclpy: whether it is there.
        gain: What it is for.
        without: What is lost where it is not there.
    """

    name: str
    probe: Callable[[Any], bool]
    gain: str
    without: str


def find_missing(node: Any) -> Iterator[Access]:
    """Yield what is not there; the node is one of rclpy's."""
    for access in ACCESSES:
        try:
            is_there = access.probe(node)
        except Exception:  # noqa: BLE001 - whatever another version raises, it is not there
            is_there = False
        if not is_there:
            yield access


def _has_c_functions(*names: str) -> bool:
    from rclpy.impl.implementation_singleton import rclpy_implementation

    library = ctypes.CDLL(rclpy_implementation.__file__)
    return all(hasattr(library, name) for name in names)


def _reads(function: Any, *names: str) -> bool:
    return all(name in function.__code__.co_names for name in names)


def _has_event_callbacks(_node: Any) -> bool:
    kinds = ('subscription_set_on_new_message', 'service_set_on_new_request')
    others = ('client_set_on_new_response', 'timer_set_on_reset')
    return _has_c_functions(*(f'rcl_{kind}_callback' for kind in kinds + others))


def _has_wait_sets(_node: Any) -> bool:
    from rclpy.impl.implementation_singleton import rclpy_implementation

    functions = ('rmw_create_wait_set', 'rmw_wait', 'rcl_subscription_get_rmw_handle')
    return hasattr(rclpy_implementation.WaitSet, 'pointer') and _has_c_functions(*functions)


def _has_futures(_node: Any) -> bool:
    from rclpy.task import Future, Task

    return hasattr(Future, '_set_executor') and _reads(Task.__init__, '_handler')


def _has_goal_events(_node: Any) -> bool:
    from rclpy.action.server import ServerGoalHandle

    return hasattr(ServerGoalHandle, '_update_state')


def _has_callers(_node: Any) -> bool:
    from rclpy.impl import rcutils_logger

    return isinstance(rcutils_logger._internal_callers, list)  # noqa: SLF001 - what is probed


def _has_ros_time(_node: Any) -> bool:
    from rclpy.clock import ROSClock

    return hasattr(ROSClock, '_set_ros_time_is_active')


def _has_serialized(_node: Any) -> bool:
    return _has_c_functions('rcl_take_serialized_message', 'rmw_get_gid_for_publisher')


def _has_fast_exit(node: Any) -> bool:
    from composer.runtime.middleware.ros_context import find_stop_all

    return hasattr(node.context, '_logging_initialized') and find_stop_all() is not None


ACCESSES = (
    Access(
        'event callbacks of rcl',
        _has_event_callbacks,
        'the executor sleeps until something has come, and asks nobody',
        'no system can run',
    ),
    Access(
        'wait sets of rmw',
        _has_wait_sets,
        'actions and QoS events are served without a thread each',
        'no system can run',
    ),
    Access(
        'futures of rclpy',
        _has_futures,
        'coroutines of callbacks go on in this executor',
        'no callback can be a coroutine',
    ),
    Access(
        'callback groups of rclpy',
        lambda node: hasattr(node.default_callback_group, '_active_entity'),
        'callbacks of a mutually exclusive group never run at the same time',
        'no system can run',
    ),
    Access(
        'descriptors of parameters',
        lambda node: hasattr(node, '_descriptors'),
        'an edit gives a parameter another type',
        'such an edit needs a restart',
    ),
    Access(
        'states of goals',
        _has_goal_events,
        'goals within the process are handed over',
        'no action can be served within the process',
    ),
    Access(
        'callers of the log',
        _has_callers,
        'a log line names the line of the behaviour',
        'it names a line of Composer',
    ),
    Access(
        '/rosout of rcl',
        lambda _: _has_c_functions('rcl_logging_rosout_enabled'),
        'log lines of all threads are on /rosout',
        'no system can run',
    ),
    Access(
        'serialized messages of rcl',
        _has_serialized,
        'topics outside the process are recorded as they come',
        'only topics within the process can be recorded',
    ),
    Access(
        'end of Fast DDS',
        _has_fast_exit,
        'a system of 1,000 nodes ends in a second',
        'it takes a minute',
    ),
    Access(
        'ROS time of rclpy',
        _has_ros_time,
        'scenarios run in virtual time',
        'composer test cannot run',
    ),
    Access(
        'start of threads',
        lambda _: hasattr(threading.Thread, '_bootstrap_inner'),
        'threads of behaviours run in virtual time',
        'composer test cannot run',
    ),
    Access(
        'flags of the interpreter',
        lambda _: hasattr(subprocess, '_args_from_interpreter_flags'),
        'workers run with the same flags of Python',
        'no worker can run',
    ),
)
