"""The exceptions of Composer: what stops the work. Errors in input are data, see `diagnostics`."""

from __future__ import annotations

from enum import IntEnum
from typing import Any


class ExitCode(IntEnum):
    """What every command of Composer ends with."""

    DONE = 0
    FAILED = 1
    USAGE = 2
    BUG = 3
    # As Ansible has it: a host cannot be reached.
    UNREACHABLE = 4
    # As pytest has it: there was no test to run.
    NOTHING_COLLECTED = 5
    # As shells have it: 128 and the number of SIGINT.
    INTERRUPTED = 130


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


class EndedWhileWaitingError(SystemExit):
    """Ends a thread that still waits when a system in virtual time has ended."""

    def __str__(self) -> str:
        return (
            'it still waited here when the system ended: wait with node.sleep, '
            'or until node.stopping'
        )


class AbortedError(ComposerError):
    """Raised by the behaviour of an action that gives its goal up: no error, but its end.

    Attributes:
        result: The payload of the result; `None` for an empty one.
    """

    def __init__(self, reason: str = '', result: Any = None) -> None:
        super().__init__(reason)
        self.result = result


class SystemStoppingError(ComposerError):
    """The system stops: what a behaviour waits for is not waited for any more."""


class CallError(ComposerError):
    """A service call has no response."""


class ServiceNotAvailableError(CallError):
    """No server appeared in time."""


class CallTimeoutError(CallError):
    """The server did not answer in time."""


class ServiceFailedError(CallError):
    """The server is in this system, and its behaviour raised an error."""


class GoalError(ComposerError):
    """A goal was not accepted, or has no result."""


class ActionNotAvailableError(GoalError):
    """No action server appeared in time."""


class GoalRejectedError(GoalError):
    """The server refused the goal."""


class GoalTimeoutError(GoalError):
    """The server did not answer in time."""


class ParametersRefusedError(ComposerError):
    """A node refused new values of its parameters, or has no such parameters."""
