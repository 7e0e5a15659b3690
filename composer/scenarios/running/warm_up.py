"""Imports what every case needs, before cases are forked: a case then starts in a tenth.

There must be no context of rclpy and no thread yet: neither would survive the fork.
"""

from __future__ import annotations

import gc
import importlib
import inspect
import sys
from contextlib import suppress

# What the first node of a process imports, and what runs a system.
_MODULES = (
    'numpy.random',
    'rclpy.action',
    'rclpy.executors',
    'rclpy.lifecycle',
    'rclpy.logging_service',
    'rclpy.node',
    'rclpy.parameter_service',
    'rclpy.time_source',
    'rclpy.type_description_service',
    'rcl_interfaces.msg',
    'rcl_interfaces.srv',
    'rosgraph_msgs.msg',
    'type_description_interfaces.srv',
    'composer.scenarios.running.prepared_case',
)
_OF_INTERFACES = ('msg', 'srv', 'action')


def warm_up() -> None:
    """Import what every case needs."""
    for name in _MODULES:
        # Not every version of ROS has all of them.
        with suppress(ModuleNotFoundError):
            importlib.import_module(name)
    # Loads the middleware.
    from rclpy.utilities import get_rmw_implementation_identifier

    get_rmw_implementation_identifier()
    # The first line of a log looks for the module of its caller among all modules.
    inspect.getframeinfo(sys._getframe())  # noqa: SLF001 - as loggers do
    load_type_supports()


def load_type_supports() -> None:
    """Load the C libraries of all interfaces that have been imported."""
    for name, module in list(sys.modules.items()):
        if name.rpartition('.')[2] in _OF_INTERFACES:
            for value in list(vars(module).values()):
                if isinstance(value, type) and hasattr(type(value), '__import_type_support__'):
                    type(value).__import_type_support__()  # type: ignore[attr-defined]


def share_memory() -> None:
    """Let the collection of garbage in children leave what there is by now alone."""
    gc.collect()
    gc.freeze()
