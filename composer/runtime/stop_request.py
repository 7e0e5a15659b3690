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
        self.code: int = ExitCode.DONE
        self.system_is_up = False
        self.kill_processes: Callable[[], None] = lambda: None
        self._callbacks: dict[Callable[[], None], None] = {}
        self._wake_ups: queue.SimpleQueue[None] = queue.SimpleQueue()

    def make(self, code: int = ExitCode.DONE) -> None:
        """Request the stop, and wake all that wait.

        A signal handler may call it while the main thread is anywhere, so it takes no lock that
        `wait` holds; a `threading.Event` would.
        """
        self.set_code(code)
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
