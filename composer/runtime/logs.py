"""The ROS loggers: their levels, from the file and the command line, and `/rosout`."""

from __future__ import annotations

import ctypes
import os
import select
import stat
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.logging import LoggingSeverity, get_logger, get_logger_level, set_logger_level

from composer.terminal import EscapingLogger

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.language.specs import NodeSpec

# The logger of Composer itself, for messages about the whole system.
system_logger = EscapingLogger(get_logger('composer'))

_rosout_is_enabled = ctypes.PyDLL(_rclpy.__file__).rcl_logging_rosout_enabled
_rosout_is_enabled.restype = ctypes.c_bool
_PROBE = 'composer_probe'


@contextmanager
def log_levels(nodes: Sequence[NodeSpec], requests: Sequence[str]) -> Iterator[None]:
    """Set the levels of the nodes' loggers, and restore the old ones at the end.

    Args:
        nodes: Their `log_level` holds unless the command line sets another one.
        requests: The levels of the command line: `debug` for all nodes and Composer itself,
            `talker:=debug` for one logger; later ones win.
    """
    names = {_logger_name(node): node.log_level for node in nodes}
    by_name: dict[str, str] = {name: level for name, level in names.items() if level}
    for request in requests:
        name, separator, level = request.rpartition(':=')
        if separator:
            by_name[name.strip('/').replace('/', '.')] = level
        else:
            by_name |= dict.fromkeys([*names, system_logger.name], level)
    before = {name: get_logger_level(name) for name in by_name}
    try:
        for name, level in by_name.items():
            set_logger_level(name, LoggingSeverity[level.upper()])
        yield
    finally:
        for name, severity in before.items():
            set_logger_level(name, severity)


def has_rosout_publisher(logger_name: str) -> bool:
    """Return whether rcl has a `/rosout` publisher for this logger.

    rcl keeps these publishers by the logger's name, from the creation of the first node with that
    name to the end of any of them. Adding a sublogger tells whether there is one, except where
    `/rosout` is turned off for the whole process: there it always succeeds.
    """
    if not _rosout_is_enabled():
        return False
    found: bool = _rclpy.rclpy_logging_rosout_add_sublogger(logger_name, _PROBE)
    if found:
        _rclpy.rclpy_logging_rosout_remove_sublogger(logger_name, _PROBE)
    return found


def is_output_unread() -> bool:
    """Return whether standard output or error is a pipe whose reader has gone, as `head` does."""
    poll = select.poll()
    for descriptor in (1, 2):
        with suppress(OSError):
            # Of other kinds, as sockets of a journal, readers may come back.
            if stat.S_ISFIFO(os.fstat(descriptor).st_mode):
                poll.register(descriptor, 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


def _logger_name(node: NodeSpec) -> str:
    """Return the name of a node's logger, as `rcl_create_node_logger_name` makes it."""
    return f'{node.namespace}/{node.name}'.strip('/').replace('//', '/').replace('/', '.')
