"""Whether a system is to end, and the exit code that it ends with."""

from __future__ import annotations

import queue
from contextlib import suppress

from composer.errors import ExitCode
from composer.runtime.behaviours.waits import StopSignal

_LONGEST_DEAF_SEC = 0.5


class StopRequest:
    """What anybody may make, and one thread waits for.

    Attributes:
        signal: Whether it was made, for those who wait in behaviours.
        code: The exit code: the first that was not 0.
    """

    def __init__(self) -> None:
        self.signal = StopSignal()
        self.code: int = ExitCode.DONE
        self._wake_ups: queue.SimpleQueue[None] = queue.SimpleQueue()

    def note(self, code: int) -> None:
        """Let this be the exit code, unless there is one that is not 0."""
        if self.code == ExitCode.DONE:
            self.code = code

    def make(self, code: int) -> None:
        """Let `wait` return.

        A signal handler may call it while the main thread is anywhere, so it takes no lock that
        `wait` holds; a `threading.Event` would.
        """
        self.note(code)
        self.signal.set()
        self._wake_ups.put(None)

    def wait(self) -> None:
        """Wait until it is made."""
        while not self.signal.is_set:
            # A signal that comes right before the wait begins does not interrupt it.
            with suppress(queue.Empty):
                self._wake_ups.get(timeout=_LONGEST_DEAF_SEC)
