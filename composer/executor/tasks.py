"""Tasks: coroutines and functions that the executor runs, and callbacks that await something.

`await future` in rclpy is a generator that yields until the future is done; rclpy's executors
resume it over and over. Here the future tells when it is done. A coroutine that yields for another
reason is resumed at once, then at growing intervals; so is one that awaits a future of an executor
that may never tell, as it calls nobody while it does not spin.
"""

import types
from collections.abc import Callable
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.task import Future, Task

_MIN_PAUSE_SEC = 0.0005
_MAX_PAUSE_SEC = 0.01
_FUTURE_AWAIT = Future.__await__.__code__


class ExecutorTask(Task):
    """A task that the executor resumes; since rclpy 7.1.9, other tasks arrange that themselves."""

    def _add_resume_callback(self, future: Any, executor: Any) -> None:
        """Leave it to the executor."""


class ScheduledTask:
    """A task, or the rest of a callback that awaits something.

    `source` is the entity whose callback it is; it is resumed only while the executor has `node`.
    """

    __slots__ = ('node', 'pause_sec', 'slow', 'source', 'task')

    def __init__(self, task: Any, source: Any = None) -> None:
        self.task = task
        self.source = source
        self.node = None if source is None else source.node
        self.pause_sec = 0.0
        self.slow = False

    def is_orphan(self) -> bool:
        """Tell whether its node has been destroyed."""
        if self.node is None:
            return False
        try:
            with self.node.handle:
                return False
        except InvalidHandle:
            return True

    def next_pause(self) -> float:
        """Return how long to wait before a coroutine is resumed that awaits nothing known."""
        pause = self.pause_sec
        self.pause_sec = min(_MAX_PAUSE_SEC, max(_MIN_PAUSE_SEC, 2 * pause))
        return pause


class ImmediateCallback:
    """A done callback of a future that the executor calls at once, in whichever thread it is."""

    __slots__ = ('_function',)

    def __init__(self, function: Callable[[], None]) -> None:
        self._function = function

    def __call__(self, _: Any) -> None:
        """Call the function, whichever future is done."""
        self._function()


def tells_at_once(future: Any) -> bool:
    """Tell whether `future` calls an `ImmediateCallback` when it is done."""
    executor = future._executor()  # noqa: SLF001
    return executor is None or hasattr(executor, 'calls_immediately')


def awaited_future(task: Any) -> Any:
    """Return the rclpy future that the coroutine of `task` awaits, None if not known."""
    awaiting = task._handler  # noqa: SLF001
    while awaiting is not None:
        if isinstance(awaiting, types.GeneratorType) and awaiting.gi_code is _FUTURE_AWAIT:
            frame = awaiting.gi_frame
            return None if frame is None else frame.f_locals.get('self')
        awaiting = getattr(awaiting, 'cr_await', None) or getattr(awaiting, 'gi_yieldfrom', None)
    return None
