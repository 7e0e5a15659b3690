"""What workers ask the process of the system."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from functools import partial
from typing import TYPE_CHECKING, Protocol

from composer.errors import ComposerError, ExitCode

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from composer.language.specs import ProcessState
    from composer.processes.channel import Functions
    from composer.runtime.behaviours.requests import RequestFailure
    from composer.runtime.elsewhere import AwaitedProcess


class SystemOfWorkers(Protocol):
    """The process of the system, as far as workers ask for it."""

    def request_stop(self, code: int = ExitCode.DONE) -> None:
        """Let the system stop."""

    def ending(self, end: Callable[[], None]) -> AbstractContextManager[bool]:
        """Have `end` called if a stop is requested before the block ends."""

    def find_process(self, name: str) -> AwaitedProcess:
        """Return an external process."""

    def list_hidden(self) -> frozenset[str]:
        """Return the full names of its nodes that have not started."""

    def list_clients(self) -> frozenset[bytes]:
        """Return the clients of services that its process knows."""

    def lose_all_servers(self, participants: frozenset[bytes]) -> None:
        """End what waits for servers of a process that was killed; see `LostParticipants`."""

    def fail_request(self, failure: RequestFailure) -> None:
        """End the call that waits for the response to a request."""


class SystemCalls:
    """Answers workers.

    Args:
        find_hidden: Returns the nodes that have not started, but for those of one worker.

    Attributes:
        system: The system, once it has begun.
    """

    def __init__(self, find_hidden: Callable[[str], frozenset[str]]) -> None:
        self.system: SystemOfWorkers | None = None
        self._find_hidden = find_hidden
        self._aborts_goals: Callable[[], bool] = _never
        self._is_outdated: Callable[[], bool] = _never

    def functions_for(self, worker: str) -> Functions:
        """Return what a worker may call, by name."""
        return {
            'request_stop': self.request_stop,
            'fail_request': self._fail_request,
            'find_hidden': partial(self._find_hidden, worker),
            'process_state': self._describe_process,
            'process_has_come_to': self._has_come_to,
            'aborts_goals': self._tell_aborts_goals,
            'is_outdated': self._tell_is_outdated,
        }

    @contextmanager
    def editing(
        self, aborts_goals: Callable[[], bool], is_outdated: Callable[[], bool]
    ) -> Iterator[None]:
        """Answer, while the block runs, what an edit asks again and again."""
        self._aborts_goals, self._is_outdated = aborts_goals, is_outdated
        try:
            yield
        finally:
            self._aborts_goals = self._is_outdated = _never

    def ending(self, end: Callable[[], None]) -> AbstractContextManager[bool]:
        """Have `end` called if a stop is requested before the block ends."""
        return self.system.ending(end) if self.system else nullcontext(enter_result=True)

    def request_stop(self, code: int) -> None:
        """End the system with an exit code."""
        if self.system is not None:
            self.system.request_stop(code)

    def lose_servers(self, participants: frozenset[bytes]) -> None:
        """End what waits for servers of a process that was killed; see `LostParticipants`."""
        if self.system is not None:
            self.system.lose_all_servers(participants)

    def _fail_request(self, failure: RequestFailure) -> None:
        self._begun.fail_request(failure)

    def list_clients(self) -> frozenset[bytes]:
        """Return the clients of services that the system's process knows."""
        return self._begun.list_clients()

    def list_hidden(self) -> frozenset[str]:
        """Return the nodes of the system's process that have not started."""
        return self._begun.list_hidden()

    def _describe_process(self, name: str) -> tuple[bool, str]:
        process = self._begun.find_process(name)
        return process.is_done, process.state

    def _has_come_to(self, name: str, state: ProcessState | None) -> bool:
        return self._begun.find_process(name).has_come_to(state)

    @property
    def _begun(self) -> SystemOfWorkers:
        if self.system is None:
            message = 'the system has not begun'
            raise ComposerError(message)
        return self.system

    def _tell_aborts_goals(self) -> bool:
        return self._aborts_goals()

    def _tell_is_outdated(self) -> bool:
        return self._is_outdated()


def _never() -> bool:
    return False
