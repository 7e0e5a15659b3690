"""Threads that run tasks: so many at a time, and those that wait for others do not count."""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rclpy.task import Task


class ThreadPool:
    """A pool that never runs out of threads because its tasks wait for each other.

    The standard library's has a fixed size, and a count of idle threads that is too high after a
    task had to queue, so that it cannot be made to grow reliably.

    Args:
        limit: How many tasks run at a time, without those that wait.
        run: Runs a task; never raises.
    """

    def __init__(self, limit: int, run: Callable[[Task], None]) -> None:
        self._limit = limit
        self._run = run
        # In order, each task once: an executor of rclpy offers it until it has begun.
        self._queue: dict[Task, None] = {}
        self._threads: list[threading.Thread] = []
        self._mine = threading.local()
        self._busy = 0
        self._idle = 0
        self._ended = False
        self._changed = threading.Condition()

    def submit(self, task: Task) -> None:
        """Let a task run when its turn comes, unless it is queued already."""
        with self._changed:
            if not self._ended:
                self._queue[task] = None
                self._rouse()

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Let another task run while this thread waits for something that tasks bring."""
        if not getattr(self._mine, 'works', False):
            # A thread of somebody else takes nobody's place.
            yield
            return
        with self._changed:
            self._busy -= 1
            self._rouse()
        try:
            yield
        finally:
            with self._changed:
                self._busy += 1

    def shutdown(self, timeout_sec: float) -> bool:
        """Begin no more tasks; return whether those that run have ended in time."""
        with self._changed:
            self._ended = True
            self._queue.clear()
            self._changed.notify_all()
        deadline = time.monotonic() + timeout_sec
        for thread in self._threads:
            thread.join(max(deadline - time.monotonic(), 0.0))
        return not any(thread.is_alive() for thread in self._threads)

    def _rouse(self) -> None:
        """Find a thread for what is queued, if more may run now."""
        wanted = min(self._limit - self._busy, len(self._queue))
        if wanted <= 0:
            return
        if self._idle < wanted:
            self._idle += 1
            thread = threading.Thread(target=self._work, name='composer-worker', daemon=True)
            self._threads.append(thread)
            thread.start()
        else:
            self._changed.notify()

    def _work(self) -> None:
        self._mine.works = True
        while (task := self._next()) is not None:
            self._run(task)
            with self._changed:
                self._busy -= 1
                self._idle += 1

    def _next(self) -> Task | None:
        with self._changed:
            self._changed.wait_for(self._may_begin)
            self._idle -= 1
            if self._ended:
                return None
            task = next(iter(self._queue))
            del self._queue[task]
            self._busy += 1
            return task

    def _may_begin(self) -> bool:
        return self._ended or (bool(self._queue) and self._busy < self._limit)
