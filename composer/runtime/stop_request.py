"""The request to stop a system: who makes it, who waits for it, and the exit code."""

from __future__ import annotations

import queue
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from composer.errors import ExitCode
from composer.runtime.logs import system_logger
from composer.terminal import is_output_unread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_POLL_SEC = 0.5


class StopRequest:
    """A request that any thread or signal handler may make.

    Attributes:
        is_set: Whether it was made.
        code: The exit code: the first one of a failure, if there is any.
        system_is_up: Whether all of the system has started.
        kill_processes: Kills all external processes at once; a signal handler may call it.
    """

    def __init__(self) -> None:
        self.is_set = False
        self._is_to_start_again = False
        self._is_final = False
        self.code: int = ExitCode.DONE
        self.system_is_up = False
        self.kill_processes: Callable[[], None] = lambda: None
        self._callbacks: dict[Callable[[], None], None] = {}
        self._wake_ups: queue.SimpleQueue[None] = queue.SimpleQueue()

    @property
    def starts_again(self) -> bool:
        """Whether the system is to start again after the stop, as long as nobody ends it."""
        return self._is_to_start_again and not self._is_final

    def make(self, code: int = ExitCode.DONE, *, starts_again: bool = False) -> None:
        """Request the stop, and wake all that wait.

        A signal handler may call it while the main thread is anywhere, so it takes no lock that
        `wait` holds; a `threading.Event` would.
        """
        self.set_code(code)
        if starts_again:
            self._is_to_start_again = True
        else:
            self._is_final = True
        self.is_set = True
        for wake in list(self._callbacks):
            wake()
        self._wake_ups.put(None)

    def fail(self, reason: str) -> None:
        """Log why the system ends by itself, and request it; not if it stops already."""
        if not self.is_set:
            system_logger.error(reason)
            self.make(ExitCode.FAILED)

    def set_code(self, code: int) -> None:
        """Set the exit code, unless there is one of a failure."""
        if self.code in (ExitCode.DONE, ExitCode.INTERRUPTED):
            self.code = code

    def wait(self) -> None:
        """Wait until it is made, or nobody reads the output any more; for one thread."""
        while not self.is_set:
            # A signal that comes right before the wait begins does not interrupt it.
            with suppress(queue.Empty):
                self._wake_ups.get(timeout=_POLL_SEC)
            if is_output_unread():
                self.fail('nobody reads the output any more, so the system ends')

    @contextmanager
    def waking(self, wake: Callable[[], None]) -> Iterator[bool]:
        """Have `wake` called when the request is made.

        Returns:
            Whether that is still to come; after the request, `wake` is not called.
        """
        is_to_come = self.add_callback(wake)
        try:
            yield is_to_come
        finally:
            self.remove_callback(wake)

    def add_callback(self, wake: Callable[[], None]) -> bool:
        """As `waking`, until `remove_callback`."""
        if self.is_set:
            return False
        self._callbacks[wake] = None
        if self.is_set:
            # It was made while the line above ran.
            wake()
        return True

    def remove_callback(self, wake: Callable[[], None]) -> None:
        """Undo `add_callback`."""
        self._callbacks.pop(wake, None)
