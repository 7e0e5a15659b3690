"""The logger of a node: rclpy's, for which the calls of one line of code may differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.impl import rcutils_logger
from rclpy.impl.rcutils_logger import RcutilsLogger

if TYPE_CHECKING:
    from rclpy.impl.logging_severity import LoggingSeverity

# rclpy leaves out the files in this list when it looks for the line of code that logs.
rcutils_logger._internal_callers.append(__file__)  # noqa: SLF001


class NodeLogger(RcutilsLogger):
    """A logger that takes any level and options from any line of code.

    rclpy keeps what a line has logged first, and refuses another level or other options from it:
    `log = logger.info if ok else logger.warning`. So each level with its options has a logger of
    rclpy's.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._alike: dict[object, RcutilsLogger] = {}

    def log(self, message: str, severity: LoggingSeverity, **options: object) -> bool:
        """See the base class."""
        key = severity, *sorted((name, repr(value)) for name, value in options.items())
        logger = self._alike.get(key)
        if logger is None:
            logger = self._alike.setdefault(key, RcutilsLogger(self.name))
        return bool(logger.log(message, severity, **options))

    def get_child(self, name: str) -> NodeLogger:
        """See the base class."""
        child = super().get_child(name)
        logger = NodeLogger(child.name)
        logger.logger_sublogger_namepair = child.logger_sublogger_namepair
        child.logger_sublogger_namepair = None  # Its finalizer would take it away.
        return logger
