"""The exceptions of Composer: what stops the work. Faults of input are data, see `diagnostics`."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """What every command of Composer ends with."""

    DONE = 0
    FAILED = 1
    USAGE = 2
    BUG = 3


class ComposerError(Exception):
    """The root of all exceptions that Composer raises on purpose.

    Attributes:
        help: What to do about it, or `None`.
    """

    def __init__(self, message: str, *, help: str | None = None) -> None:  # noqa: A002 - the word
        super().__init__(message)
        self.help = help


class UsageError(ComposerError):
    """The command line asks for something that Composer does not offer."""


class RosNotFoundError(ComposerError):
    """The command needs ROS 2, and this Python has no rclpy."""


class StartError(ComposerError):
    """The system could not be brought up; all of it has been torn down again."""
