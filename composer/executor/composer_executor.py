"""`ComposerExecutor`: rclpy's multi-threaded executor at a cost that does not grow."""

import atexit
import gc
import os
import threading
import warnings
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import MultiThreadedExecutor, TimeoutObject
from rclpy.task import Future, Task

from composer.executor.after_fork import RefusedSpinner
from composer.executor.deadlines import DelayedCall
from composer.executor.sources.event_source import ExecutorParts
from composer.executor.sources.inbox import Inbox
from composer.executor.spinner import Spinner
from composer.executor.switch_interval import short_switch_interval
from composer.executor.tasks import ExecutorTask, ImmediateCallback, ScheduledTask
from composer.executor.wait_set_thread import WaitSetThread

_MAX_THREADS = 256
_FEW_EXECUTORS = 32
_NEVER_CALLED = (
    '_make_handler',
    '_take_client',
    '_take_guard_condition',
    '_take_service',
    '_take_subscription',
    '_take_timer',
    '_take_waitable',
)


class ComposerExecutor(MultiThreadedExecutor):
    """Runs callbacks in a pool of threads; an event costs the same beside any number of entities.

    It can be used wherever `rclpy.executors.MultiThreadedExecutor` is. The differences:

    - Without `num_threads`, threads are added as callbacks block, up to 256, so a slow callback
      delays nobody outside its group. With it, so many callbacks run at the same time.
    - `spin_once` waits up to 50 ms for the end of the callback that it began.
    - `shutdown` waits for running callbacks, as rclpy documents; but not for those that call it.
    - Several threads may spin at the same time, and callbacks may, whatever `num_threads` is.
    - It takes messages itself: a subclass that overrides rclpy's `_take_*` or `_make_handler` is
      warned. `can_execute` may be overridden; `wake` makes the executor ask again.
    - A forked child cannot use it.
    - While `spin` and `spin_until_future_complete` run, `sys.getswitchinterval()` of the process
      is at most 1 ms: see `switch_interval`.

    Args:
        num_threads: How many callbacks may run at the same time; None for as many as block.
        context: The context; None for the default one.

    Attributes:
        calls_immediately: That `create_task` calls an `ImmediateCallback` at once.
        has_own_rules: Whether a subclass says what may be executed.
        is_forked: Whether this process is a child that was forked after the executor was made.
    """

    calls_immediately = True
    _is_ended = True  # Until it has been made.

    def __init__(self, num_threads: int | None = None, *, context: Any = None) -> None:
        # Its pool is never used, and it would warn of one with a single thread.
        _collect_garbage()
        super().__init__(2 if num_threads in (None, 1) else num_threads, context=context)
        self.is_forked = False
        self.has_own_rules = type(self).can_execute is not ComposerExecutor.can_execute
        self._spinner = self._create_spinner(num_threads or _MAX_THREADS)
        _executors.add(self)
        self._is_ended = False

    def _create_spinner(self, max_running: int) -> Spinner:
        """Return what is behind all methods."""
        parts = ExecutorParts(self, max_running)
        return Spinner(parts, WaitSetThread(self._guard, self._sigint_gc, self.context))

    def __init_subclass__(cls, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        for name in _NEVER_CALLED:
            if getattr(cls, name, None) is not getattr(MultiThreadedExecutor, name, None):
                message = f'{cls.__name__}.{name} is never called by ComposerExecutor'
                warnings.warn(message, stacklevel=2)

    def can_execute(self, entity: Any) -> bool:
        """Tell whether the callback of `entity` may be executed; a subclass may have its rules."""
        return bool(entity.callback_group.can_execute(entity))

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Any:
        """Add a callback or coroutine to be executed during `spin`; returns its future."""
        if type(callback) is ImmediateCallback:
            if not self.is_forked:
                callback(*args)
            return None
        task: Any = ExecutorTask(callback, args, kwargs, executor=self)
        if self.is_forked:
            return task  # A future may have created it. It runs when the executor spins: never.
        self._spinner.scheduler.add_task(ScheduledTask(task))
        return task

    def _call_task_in_next_spin(self, task: Any) -> None:
        """Do nothing: since rclpy 7.1.9, a task that yields calls this, and is resumed anyway."""

    def call_later(self, delay_sec: float, callback: Callable[[], Any]) -> DelayedCall:
        """Add a callback like `create_task`, `delay_sec` from now; it can be cancelled."""
        deadlines = self._spinner.poller.deadlines
        executor = weakref.proxy(self)  # What waits must not keep it.
        return DelayedCall(deadlines, delay_sec, lambda: executor.create_task(callback))

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Let a callback wait for others: meanwhile it does not count against `num_threads`."""
        if self.is_forked or not self._spinner.workers.hand_over_in_callback():
            yield
            return
        self._spinner.scheduler.add_waiting(1)
        try:
            yield
        finally:
            self._spinner.scheduler.add_waiting(-1)

    def limit_threads(self, num_threads: int | None) -> None:
        """Let so many callbacks run at the same time from now on; None for as many as block."""
        self._spinner.scheduler.limit_running(num_threads or _MAX_THREADS)

    def add_node(self, node: Any) -> bool:
        """Run the callbacks of `node`; returns False if the executor has it already."""
        scheduler = self._spinner.scheduler  # Refused in a forked child.
        with _moving:
            if node in self._nodes:
                return False
            # It leaves its executor first, which stops to listen to what this one will listen to.
            if node.executor not in (None, self):
                node.executor.remove_node(node)
            with self._nodes_lock:
                self._nodes.add(node)
            node.executor = self
        scheduler.retry_suspended()
        self.wake()
        return True

    def remove_node(self, node: Any) -> None:
        """Run the callbacks of `node` no more: none begins once this has returned."""
        with self._nodes_lock:
            if node not in self._nodes:
                return
            self._nodes.remove(node)
        self._spinner.registry.drop(node)
        self._spinner.scheduler.retry_suspended()
        self.wake()

    def open_inbox(self, node: Any, entity: Any, depth: int | None) -> Inbox:
        """Return a new queue by which something gets to an entity without the middleware.

        Args:
            entity: A subscription, which gets messages; a service, which gets objects with the
                request as `message`, `respond(response)` and `fail(error)`; or an action, which
                gets functions that return what is awaited.
            depth: How many it holds; `None` for any number.
        """
        return self._spinner.registry.open_inbox(node, entity, depth)

    def execute_at_once(self, inbox: Inbox, item: Any) -> bool:
        """Hand `item` to an entity and execute its callback in this thread, which waits for it.

        Returns:
            False if that must be left to others: this is no callback, the entity or its group is
            busy, or it took long the last time. Then `item` was not handed over.
        """
        return not self.is_forked and self._spinner.execute_at_once(inbox, item)

    def observe(self, node: Any, entity: Any, observer: Any) -> None:
        """Have `observer` told of what comes to a subscription or a timer of `node`.

        It is a `QueueObserver` or a `TickObserver` (`sources.entity_sources`).
        """
        self._spinner.registry.observe(node, entity, observer)

    def wake(self) -> None:
        """Look again at the entities, their groups, the context and what is waited for."""
        # The context may be shut down while the executor is made.
        if self._is_ended or self.is_forked:
            return
        self._spinner.registry.is_stale = True
        self._spinner.scheduler.retry_deferred()
        self._spinner.wake()

    def spin(self) -> None:
        """Execute callbacks until the executor or the context is shut down.

        An exception of a callback is raised here; spinning can be resumed after it.
        """
        with short_switch_interval:
            self._spinner.spin(lambda: False, None)

    def spin_until_future_complete(
        self,
        future: Future,
        timeout_sec: float | None = None,
    ) -> None:
        """Execute callbacks until `future` is done or cancelled, or `timeout_sec` has passed."""
        if timeout_sec == 0:
            self.spin_once_until_future_complete(future, 0)
            return
        with short_switch_interval, self._watching(future) as is_watched:
            self._spinner.spin(_is_over(future), timeout_sec, is_watched=is_watched)

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and execute it, for at most `timeout_sec` (None: for ever)."""
        self._spinner.spin_once(lambda: False, timeout_sec)

    def spin_once_until_future_complete(
        self,
        future: Future,
        timeout_sec: float | TimeoutObject | None = None,
    ) -> None:
        """`spin_once`, but stop waiting when `future` is done."""
        if isinstance(timeout_sec, TimeoutObject):
            timeout_sec = float(timeout_sec.timeout)
        with self._watching(future) as is_watched:
            self._spinner.spin_once(_is_over(future), timeout_sec, is_watched=is_watched)

    @contextmanager
    def _watching(self, future: Any) -> Iterator[bool]:
        """Look again when `future` is done; yields whether that needs looking after callbacks."""
        callback = ImmediateCallback(self._spinner.notifier.notify)
        future.add_done_callback(callback)
        try:
            # Any other class may compute whether it is done, or call when nobody listens.
            yield type(future) not in (Future, Task, ExecutorTask)
        finally:
            with suppress(AttributeError):  # As that of concurrent.futures.
                future.remove_done_callback(callback)

    def shutdown(self, timeout_sec: float | None = None, *, wait_for_threads: bool = True) -> bool:
        """Begin no more callbacks and wait for those that run.

        Args:
            timeout_sec: Seconds to wait; None or negative for ever, 0 not at all.
            wait_for_threads: Wait until the threads that have nothing to do any more have ended.

        Returns:
            False if callbacks still ran after that time; then this can be called again.
        """
        if self.is_forked:
            return True
        self._is_shutdown = True
        if not self._spinner.stop(timeout_sec):
            return False
        with self._nodes_lock:
            self._nodes: set[Any] = set()
        self._is_ended = True
        self._spinner.tear_down(wait_for_threads=wait_for_threads)
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
        self._spinner.report(error)

    def note_unanswered(self, service: Any, header: Any, error: BaseException) -> None:
        """Note that a request over the middleware gets no response: its callback raised."""

    def halt(self) -> None:
        """Wait for running callbacks, as rclpy's pool does when the interpreter ends.

        Then end the threads: rclpy aborts a process that exits while one of them waits in it.
        """
        self._is_shutdown = True
        self._is_ended = True  # A thread that is left may hold a lock for ever.
        self._spinner.stop(None)
        self._spinner.wait_set_thread.close()

    def leave_to_parent(self) -> None:
        """Refuse to spin and destroy nothing: this is a forked child."""
        self.is_forked = self._is_shutdown = self._is_ended = True
        _kept_for_parent.append((self._spinner, self._sigint_gc))
        self._spinner.leave_to_parent()
        refused: Any = RefusedSpinner()
        self._spinner = refused
        self._guard = self._sigint_gc = None
        self._nodes = set()

    def __del__(self) -> None:
        """Free all that the executor has, if nobody has shut it down.

        No thread that waits refers to it, so this comes as soon as nobody else does. `__init__`
        may have failed half-way.
        """
        with suppress(AttributeError, InvalidHandle, ValueError):
            if self._is_ended:
                super().__del__()
            else:
                ComposerExecutor.shutdown(self, 0, wait_for_threads=False)


def _is_over(future: Any) -> Callable[[], bool]:
    return lambda: future.done() or future.cancelled()


# Held while a node leaves one executor for another: two threads may move the same node.
_moving = threading.RLock()
_executors: weakref.WeakSet[ComposerExecutor] = weakref.WeakSet()
_most_executors = _FEW_EXECUTORS


def _collect_garbage() -> None:
    """Free executors that only their own nodes refer to, before they use up all descriptors.

    Python does that too seldom: it counts objects, of which an executor has few.
    """
    global _most_executors  # noqa: PLW0603
    if len(_executors) >= _most_executors:
        gc.collect()
        _most_executors = max(_FEW_EXECUTORS, 2 * len(_executors))


@atexit.register
def _halt_all() -> None:
    for executor in tuple(_executors):
        executor.halt()


# In a forked child: what only the parent may destroy, and so must stay referenced.
_kept_for_parent: list[Any] = []


def _leave_all_to_parent() -> None:
    _moving._at_fork_reinit()  # type: ignore[attr-defined]  # noqa: SLF001
    for executor in tuple(_executors):
        executor.leave_to_parent()
    _executors.clear()


os.register_at_fork(after_in_child=_leave_all_to_parent)
