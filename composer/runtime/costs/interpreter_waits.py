"""How long a thread waits that wants the interpreter, as a callback does that is due."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from random import Random
from time import monotonic_ns

from composer.records import record

_SHORTEST_SEC, _LONGEST_SEC = 0.03, 0.07
# What the kernel adds to a sleep by itself.
_SLACK_NS = 100_000
_NS_PER_SEC = 1e9


@record
class Waits:
    """How long such waits were.

    Attributes:
        mean_ms: On average.
        max_ms: The longest.
    """

    mean_ms: float
    max_ms: float


class InterpreterWaits:
    """A thread that sleeps, and measures by how much too late it goes on, until `stop`.

    What it waited for a processor, which other programs may have used, does not count.
    """

    def __init__(self) -> None:
        self._waited_ns: list[int] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(
            target=self._run, name='composer-interpreter-waits', daemon=True
        )
        self._thread.start()

    def take(self) -> Waits | None:
        """Return the waits since this was last asked; `None` if there were none."""
        waited_ns, self._waited_ns = self._waited_ns, []
        if not waited_ns:
            return None
        return Waits(sum(waited_ns) / len(waited_ns) / 1e6, max(waited_ns) / 1e6)

    def stop(self) -> None:
        """Measure no more."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        random = Random(0)  # noqa: S311 - only to keep no step with timers
        queue = _RunQueue()
        queued_ns = queue.waited_ns()
        while True:
            pause_sec = random.uniform(_SHORTEST_SEC, _LONGEST_SEC)
            due_ns = monotonic_ns() + int(pause_sec * _NS_PER_SEC)
            if self._ended.wait(pause_sec):
                break
            late_ns = monotonic_ns() - due_ns - _SLACK_NS
            before_ns, queued_ns = queued_ns, queue.waited_ns()
            self._waited_ns.append(max(0, late_ns - (queued_ns - before_ns)))
        queue.close()


class _RunQueue:
    """How long this thread waited for a processor, as Linux counts it where it does.

    Source: https://docs.kernel.org/scheduler/sched-stats.html
    """

    def __init__(self) -> None:
        self._file = -1
        with suppress(OSError):
            self._file = os.open('/proc/thread-self/schedstat', os.O_RDONLY | os.O_CLOEXEC)

    def waited_ns(self) -> int:
        with suppress(OSError, ValueError, IndexError):
            return int(os.pread(self._file, 100, 0).split()[1])
        return 0

    def close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
