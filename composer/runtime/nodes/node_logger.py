"""The logger of a node: rclpy's, for any text, and for calls that differ in one line of code."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.impl import rcutils_logger
from rclpy.impl.rcutils_logger import RcutilsLogger

from composer.terminal import escape_log

if TYPE_CHECKING:
    from rclpy.impl.logging_severity import LoggingSeverity

# rclpy leaves out the files in this list when it looks for the line of code that logs.
rcutils_logger._internal_callers.append(__file__)  # noqa: SLF001


class NodeLogger(RcutilsLogger):
    """A logger that takes any level and options from any line of code.

    rclpy keeps what a line has logged first, and refuses another level or other options from it:
    `log = logger.info if ok else logger.warning`. So each level with its options has a logger of
    rclpy's. What a behaviour logs may be what others have sent: it can forge no line, and no
    terminal obeys more of it than its colours.
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
        text = escape_log(message) if isinstance(message, str) else message
        return bool(logger.log(text, severity, **options))

    def get_child(self, name: str) -> NodeLogger:
        """See the base class."""
        child = super().get_child(name)
        logger = NodeLogger(child.name)
        logger.logger_sublogger_namepair = child.logger_sublogger_namepair
        child.logger_sublogger_namepair = None  # Its finalizer would take it away.
        return logger
