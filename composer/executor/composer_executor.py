"""`ComposerExecutor`: rclpy's multi-threaded executor at a cost that does not grow."""

import atexit
import os
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import MultiThreadedExecutor, TimeoutObject
from rclpy.task import Future, Task

from composer.executor.deadlines import Delay
from composer.executor.missed import Missed
from composer.executor.spinner import COURTESY_SEC, Engine
from composer.executor.tasks import Resume, TaskRun

_MOST_THREADS = 256


class ComposerExecutor(MultiThreadedExecutor):
    """Runs callbacks in a pool of threads; an event costs the same beside any number of entities.

    It can be used wherever `rclpy.executors.MultiThreadedExecutor` is. Differences to be seen:

    - Without `num_threads`, threads are made as callbacks block, up to 256, so that a slow
      callback delays nobody outside its group. With it, so many callbacks run at the same time.
    - `spin_once` waits up to 50 ms for the callback that it began to finish.
    - `shutdown` waits for running callbacks, as rclpy documents; but not for the one it is called
      from, and without `timeout_sec` not for long once the context has been shut down.
    - Several threads may spin at the same time.
    - While one does, the process's `sys.getswitchinterval()` is at most 1 ms: see `switching`.

    Args:
        num_threads: How many callbacks may run at the same time; None for as many as block.
        context: The context; None for the default one.
    """

    def __init__(self, num_threads: int | None = None, *, context: Any = None) -> None:
        super().__init__(num_threads, context=context)  # Whose pool is never used.
        self.is_inherited = False
        self._engine = Engine(self, num_threads or _MOST_THREADS, self._guard, self._sigint_gc)
        _executors.add(self)

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Any:
        """Add a callback or coroutine to be executed during `spin`; returns its future."""
        if type(callback) is Resume:
            callback(*args)
            return None
        task: Any = Task(callback, args, kwargs, executor=self)
        self._engine.schedule.add_run(TaskRun(task))
        return task

    def call_later(self, delay_sec: float, callback: Callable[[], Any]) -> Delay:
        """Add a callback as `create_task` does, `delay_sec` from now; it can be cancelled."""
        return Delay(self._engine.alarms, delay_sec, lambda: self.create_task(callback))

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Let a callback wait for others: meanwhile it does not count against `num_threads`."""
        if not self._engine.crew.step_aside():
            yield
            return
        self._engine.schedule.step_aside(1)
        try:
            yield
        finally:
            self._engine.schedule.step_aside(-1)

    def add_node(self, node: Any) -> bool:
        """Manage the callbacks of `node`; returns False if it is here already."""
        with self._nodes_lock:
            if node in self._nodes:
                return False
            self._nodes.add(node)
            self._engine.schedule.set_nodes(self._nodes)
        node.executor = self
        self.wake()
        return True

    def remove_node(self, node: Any) -> None:
        """Manage the callbacks of `node` no more: none begins once this has returned."""
        with self._nodes_lock:
            if node not in self._nodes:
                return
            self._nodes.remove(node)
            self._engine.schedule.set_nodes(self._nodes)
        self._engine.registry.drop(node)
        self.wake()

    def missed(self, node: Any, entity: Any) -> Missed:
        """Return what a subscription or timer of `node` missed because callbacks took too long.

        Counting begins when the executor sees the entity; an unknown entity has missed nothing.
        """
        source = self._engine.registry.source_of(node, entity)
        return Missed() if source is None else source.missed()

    def wake(self) -> None:
        """Look anew at the entities, their groups, the context and what is waited for."""
        self._engine.registry.is_stale = True
        self._engine.schedule.retry()
        self._engine.wake()

    def spin(self) -> None:
        """Execute callbacks until the executor or the context is shut down.

        An exception of a callback is raised here; spinning can be resumed after it.
        """
        self._engine.spin_until(lambda: False, None)

    def spin_until_future_complete(
        self,
        future: Future,
        timeout_sec: float | None = None,
    ) -> None:
        """Execute callbacks until `future` is done or cancelled, or `timeout_sec` has passed."""
        if timeout_sec == 0:
            self.spin_once_until_future_complete(future, 0)
            return
        with _Notice(future, self._engine.news.tell):
            self._engine.spin_until(_is_settled(future), timeout_sec)

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and execute it, at most `timeout_sec` (None: for ever)."""
        self._engine.spin_once(lambda: False, timeout_sec)

    def spin_once_until_future_complete(
        self,
        future: Future,
        timeout_sec: float | TimeoutObject | None = None,
    ) -> None:
        """`spin_once`, but stop waiting when `future` is done."""
        if isinstance(timeout_sec, TimeoutObject):
            timeout_sec = float(timeout_sec.timeout)
        with _Notice(future, self._engine.wake):
            self._engine.spin_once(_is_settled(future), timeout_sec)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Begin no more callbacks and wait for those that run.

        Args:
            timeout_sec: Seconds to wait; None or negative for ever, 0 not at all.

        Returns:
            False if callbacks still ran after that time; then this can be called again.
        """
        self._is_shutdown = True
        must_end = timeout_sec is not None or self._engine.context_is_valid()
        if not self._engine.stop(timeout_sec if must_end else COURTESY_SEC) and must_end:
            return False
        self._engine.tear_down(self.get_nodes())
        with self._nodes_lock:
            self._nodes: set[Any] = set()
        with self._shutdown_lock:
            for guard in (self._guard, self._sigint_gc):
                if guard is not None:
                    guard.destroy()
            self._guard: Any = None
            self._sigint_gc: Any = None
        self._executor.shutdown(wait=False)
        return True

    def report(self, error: BaseException) -> None:
        """Have `error` raised where the executor spins."""
        self._engine.report(error)

    def halt(self) -> None:
        """End the threads: rclpy aborts a process that ends while one of them waits in it."""
        self._is_shutdown = True
        self._engine.stop(COURTESY_SEC)
        self._engine.lane.close()

    def leave_to_parent(self) -> None:
        """Be shut down, and nothing of it destroyed: this process was forked."""
        self.is_inherited = self._is_shutdown = True
        _of_parent.append((self._engine, dict(vars(self._engine.registry)), self._sigint_gc))
        self._guard = self._sigint_gc = None
        self._nodes = set()
        self._engine.leave_to_parent()

    def __del__(self) -> None:
        """Do what rclpy does, though `__init__` may have failed half-way."""
        with suppress(AttributeError, InvalidHandle, ValueError):
            super().__del__()


class _Notice:
    """Has a function called when a future is done, as long as the context is entered."""

    def __init__(self, future: Any, function: Callable[[], None]) -> None:
        self._future = future
        self._resume = Resume(function)

    def __enter__(self) -> None:
        self._future.add_done_callback(self._resume)

    def __exit__(self, *_: object) -> None:
        self._future.remove_done_callback(self._resume)


def _is_settled(future: Any) -> Callable[[], bool]:
    return lambda: future.done() or future.cancelled()


_executors: weakref.WeakSet[ComposerExecutor] = weakref.WeakSet()


@atexit.register
def _halt_all() -> None:
    for executor in tuple(_executors):
        executor.halt()


_of_parent: list[Any] = []


def _leave_to_parent() -> None:
    for executor in tuple(_executors):
        executor.leave_to_parent()
    _executors.clear()


os.register_at_fork(after_in_child=_leave_to_parent)
