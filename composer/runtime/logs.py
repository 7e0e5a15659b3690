"""The ROS loggers: their levels, from the file and the command line, and `/rosout`."""

from __future__ import annotations

import ctypes
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.logging import LoggingSeverity, get_logger, get_logger_level, set_logger_level

from composer.spelling import suggest
from composer.terminal import EscapingLogger

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.language.specs import NodeSpec, SystemSpec

# The logger of Composer itself, for messages about the whole system.
system_logger = EscapingLogger(get_logger('composer'))

_rosout_is_enabled = ctypes.PyDLL(_rclpy.__file__).rcl_logging_rosout_enabled
_rosout_is_enabled.restype = ctypes.c_bool
_PROBE = 'composer_probe'
# The loggers of ROS itself begin with one of these.
_LIBRARIES = ('rcl', 'rcutils', 'rmw', 'rosidl')


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
            by_name[_as_logger_name(name)] = level
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


def set_level(node: NodeSpec, requests: Sequence[str], *, exists: bool = True) -> None:
    """Give the logger of a node its level: that of the command line, of the file, or the default.

    Args:
        requests: See `log_levels`.
        exists: Whether there is such a node; if not, what the file said of it does not count.
    """
    own_name = _logger_name(node)
    level: str | None = node.log_level if exists else None
    for request in requests:
        name, separator, requested = request.rpartition(':=')
        if _as_logger_name(name) == own_name or not separator:
            level = requested
    set_logger_level(own_name, LoggingSeverity[(level or 'unset').upper()])


def warn_of_unknown_loggers(spec: SystemSpec, requests: Sequence[str]) -> None:
    """Log a warning for each level that the command line sets for a node that there is not.

    Parts of names are those of all nodes in a namespace, and longer names those of the loggers of
    a node's behaviours. ROS itself has loggers, too; those of external processes are not known.
    """
    if any(process.is_ros for process in spec.processes.values()):
        return
    known = [_logger_name(node) for node in spec.nodes.values()]
    for request in requests:
        name, separator, _ = request.rpartition(':=')
        logger = _as_logger_name(name)
        if not separator or logger == system_logger.name or logger.startswith(_LIBRARIES):
            continue
        if not any(_is_within(logger, each) or _is_within(each, logger) for each in known):
            advice = suggest(logger, known, 'there are', 'it has none')
            system_logger.warning(f"--log-level: this system has no node '{name}' ({advice})")


def _is_within(logger: str, outer: str) -> bool:
    return f'{logger}.'.startswith(f'{outer}.')


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


def _as_logger_name(name: str) -> str:
    return name.strip('/').replace('/', '.')


def _logger_name(node: NodeSpec) -> str:
    """Return the name of a node's logger, as `rcl_create_node_logger_name` makes it."""
    return f'{node.namespace}/{node.name}'.strip('/').replace('//', '/').replace('/', '.')
