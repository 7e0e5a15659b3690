"""Coroutines: what they wait for, and how they go on.

`await future` in rclpy is a generator that yields until the future is done; rclpy's executors
resume it over and over. Here the future is asked to say when it is done. What yields for another
reason is resumed at once, then at growing intervals.
"""

import types
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.task import Future, Task

_FUTURE_AWAIT = Future.__await__.__code__
_MOST_PAUSE_SEC = 0.01
_LEAST_PAUSE_SEC = 0.0005


class Resume:
    """A done callback that the executor runs at once, wherever it is."""

    __slots__ = ('_function',)

    def __init__(self, function: Any) -> None:
        self._function = function

    def __call__(self, _: Any) -> None:
        """Do it, whichever future is done."""
        self._function()


class TaskRun:
    """A task on its way through the schedule.

    `source` is the entity whose callback it is; it goes on only while `node` is in the executor.
    """

    __slots__ = ('node', 'pause_sec', 'slow', 'source', 'task')

    def __init__(self, task: Any, source: Any = None) -> None:
        self.task = task
        self.source = source
        self.node = None if source is None else source.node
        self.pause_sec = 0.0
        self.slow = False

    def is_orphan(self) -> bool:
        """See `schedule.Run`."""
        if self.node is None:
            return False
        try:
            with self.node.handle:
                return False
        except InvalidHandle:
            return True

    def next_pause(self) -> float:
        """How long to wait before a coroutine that waits for nothing known is tried again."""
        pause = self.pause_sec
        self.pause_sec = min(_MOST_PAUSE_SEC, max(_LEAST_PAUSE_SEC, 2 * pause))
        return pause


def task_of(coroutine: Any, executor: Any) -> Any:
    """Return a task that goes on with a coroutine which may have begun."""
    return Task(coroutine, executor=executor)


def awaited_future(task: Any) -> Any:
    """Return the rclpy future that the coroutine of `task` waits for, None if not known."""
    waiting = task._handler  # noqa: SLF001
    while waiting is not None:
        if isinstance(waiting, types.GeneratorType) and waiting.gi_code is _FUTURE_AWAIT:
            frame = waiting.gi_frame
            return None if frame is None else frame.f_locals.get('self')
        waiting = getattr(waiting, 'cr_await', None) or getattr(waiting, 'gi_yieldfrom', None)
    return None
