"""What spinning is: puts the parts of one executor together, and lets them run."""

import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.executor.after_fork import end_child, reset_locks
from composer.executor.entity_registry import EntityRegistry
from composer.executor.event_loop import CallbackRunner, EventLoop
from composer.executor.sources.event_source import ExecutorParts
from composer.executor.switch_interval import short_switch_interval
from composer.executor.wait_set_thread import WaitSetThread
from composer.executor.worker_threads import TAKEOVER_SEC, Worker

GRACE_SEC = 0.05
"""How long `spin_once` waits for the callback that it began, and `spin` for those under way."""


class Notifier:
    """Makes threads that wait for a condition check it again.

    There is no lock, as a `threading.Condition` has one: the main thread may be interrupted by
    a `KeyboardInterrupt` at any point.
    """

    def __init__(self) -> None:
        self._waiting: dict[SimpleQueue[None], None] = {}

    def notify(self) -> None:
        """Have all conditions checked."""
        for wake_ups in list(self._waiting):
            # One that has not been taken yet is followed by a check, too.
            if wake_ups.empty():
                wake_ups.put(None)

    def wait_for(self, condition: Callable[[], bool], timeout_sec: float | None) -> bool:
        """Wait until `condition()`, which is called with no lock held; False after the timeout."""
        deadline = None if timeout_sec is None or timeout_sec < 0 else (monotonic() + timeout_sec)
        wake_ups: SimpleQueue[None] = SimpleQueue()
        try:
            self._waiting[wake_ups] = None
            while not condition():
                left = None if deadline is None else deadline - monotonic()
                if left is not None and left <= 0:
                    return False
                with suppress(Empty):
                    wake_ups.get(timeout=left)
            return True
        finally:
            self._waiting.pop(wake_ups, None)


class Spinner:
    """All that is behind the methods of `ComposerExecutor`.

    Args:
        executor: The executor that futures are given.
        max_running: How many callbacks may run at the same time.
        guard: A guard condition for the wait set thread.
        sigint_guard: The guard condition that rclpy triggers on SIGINT and SIGTERM.
    """

    def __init__(self, executor: Any, max_running: int, guard: Any, sigint_guard: Any) -> None:
        parts = ExecutorParts(executor, max_running)
        self.poller = parts.poller
        self.scheduler = parts.scheduler
        self.notifier = Notifier()
        self.is_shutdown = False
        self.wait_set_thread = WaitSetThread(guard, sigint_guard, executor.context, self)
        self.registry = EntityRegistry(parts, self.wait_set_thread)
        loop = EventLoop(parts, self.registry, self._execute, self.report, self.notifier.notify)
        self.workers = loop.workers
        self._executor = executor
        self._runner = CallbackRunner(parts)
        self._spinning = 0
        self._spinning_once = 0
        self._count_lock = threading.Lock()
        self._waiting_for_end = 0
        self._errors: deque[BaseException] = deque()

    # Errors and wake-ups

    def report(self, error: BaseException) -> None:
        """Have `error` raised where the executor spins, unless it only means a lost context."""
        if self.workers.is_forked:
            end_child(error)
        if isinstance(error, _rclpy.RCLError) and not self.is_context_valid():
            return
        self._errors.append(error)
        self.notifier.notify()

    def _raise_error(self) -> None:
        """Raise the oldest error that was reported and not raised yet."""
        if self._errors:
            raise self._errors.popleft()

    def wake(self) -> None:
        """Make the leader and all threads that wait look again."""
        self.poller.wake()
        self.notifier.notify()

    def _is_alive(self) -> bool:
        return not self.is_shutdown and self.is_context_valid()

    def is_context_valid(self) -> bool:
        """Like `Context.ok`, which waits while the context is being shut down."""
        handle: Any = self._executor.context.handle
        try:
            with handle:
                return bool(handle.ok())
        except InvalidHandle:
            return False

    # Spinning

    def spin_until(self, condition: Callable[[], bool], timeout_sec: float | None) -> None:
        """Let workers execute callbacks until `condition()`, an error, a timeout or the end."""
        self._raise_error()
        self._start_spinning()
        try:
            self.notifier.wait_for(
                lambda: bool(self._errors) or condition() or not self._is_alive(), timeout_sec
            )
        finally:
            self._stop_spinning()
        self._raise_error()

    def spin_once(self, condition: Callable[[], bool], timeout_sec: float | None) -> None:
        """Let a worker execute one callback; stop waiting for one when `condition()`."""
        self._raise_error()
        if timeout_sec is not None and timeout_sec < 0:
            timeout_sec = None
        deadline = None if timeout_sec is None else monotonic() + timeout_sec
        self.wait_set_thread.add_user()
        with self._count_lock:
            self._spinning_once += 1
        try:
            if self._is_alive():
                self._look_at_everything()
            while self._is_alive() and not condition() and not self._run_one():
                left = None if deadline is None else deadline - monotonic()
                if left is not None and left <= 0:
                    break
                self._wait_for_work(left)
        finally:
            with self._count_lock:
                self._spinning_once -= 1
            self.wait_set_thread.remove_user()
            if self.is_shutdown:
                self.notifier.notify()
        self._raise_error()

    def _execute(self, work: Any) -> bool:
        """Execute what the scheduler started; False if there was nothing to take."""
        ran = self._runner.execute(work)
        if len(self.scheduler):
            self.poller.wake()
        if self._waiting_for_end:
            self.notifier.notify()
        return ran

    def stop(self, timeout_sec: float | None) -> bool:
        """Begin no more callbacks, ever; returns whether those that ran have ended in time."""
        with self._count_lock:
            self.is_shutdown = True
            self.scheduler.close()
        self.wake()
        return self._wait_for_end(timeout_sec)

    def tear_down(self, nodes: list[Any], timeout_sec: float) -> None:
        """Stop listening to `nodes`, end the threads, and close what they waited for.

        Args:
            nodes: The nodes.
            timeout_sec: How long to wait for the end of the threads.
        """
        for node in nodes:
            with suppress(InvalidHandle):
                self.registry.drop(node)
        self.wait_set_thread.close()
        self.workers.end(timeout_sec)
        if not self.workers.is_in_callback():
            self.notifier.wait_for(lambda: not self._spinning_once, GRACE_SEC)
        if not self._spinning_once and not self.workers.has_threads():
            self.poller.close()

    def reset_after_fork(self) -> None:
        """Be shut down: this is a forked child, and all of this belongs to its parent."""
        others = (self.wait_set_thread, self.registry, self.workers)
        reset_locks((self, self._executor, self.scheduler, self.poller, self.poller.deadlines))
        reset_locks(others)
        self.is_shutdown = True
        self.scheduler.reset_after_fork(int(self.workers.is_in_callback()))
        for part in (self.poller, *others):
            part.reset_after_fork()

    def _start_spinning(self) -> None:
        self.wait_set_thread.add_user()
        short_switch_interval.add_user()
        with self._count_lock:
            self._spinning += 1
            self.scheduler.is_spinning = not self.is_shutdown
        if self.scheduler.is_spinning:
            self.workers.start()

    def _stop_spinning(self) -> None:
        with self._count_lock:
            self._spinning -= 1
            last = not self._spinning
            if last:
                self.scheduler.is_spinning = False
        short_switch_interval.remove_user()
        self.wait_set_thread.remove_user()
        if last:
            self.poller.wake()
            self._wait_for_end(GRACE_SEC)

    def _look_at_everything(self) -> None:
        self.registry.refresh_if_stale()
        self.wait_set_thread.flush_if_used()
        self._runner.resume_paused()
        self.poller.peek()

    def _wait_for_work(self, timeout_sec: float | None) -> None:
        if self._spinning:  # Another thread leads, and may take the event or the wake-up.
            timeout_sec = GRACE_SEC if timeout_sec is None else min(timeout_sec, GRACE_SEC)
        self.poller.wait_if(self._is_idle, timeout_sec)
        self.registry.refresh_if_stale()

    def _run_one(self) -> bool:
        """Have a worker run one callback, if one is ready, and wait a little for its end."""
        while (work := self.scheduler.start_next(alone=True)) is not None:
            job = _OneCallback(self._execute, work)
            self.workers.run(job)
            if job.has_run(TAKEOVER_SEC if work.slow else GRACE_SEC):
                return True
        return False

    def _wait_for_end(self, timeout_sec: float | None) -> bool:
        """Wait until no callback runs, except the one from which this is called."""
        with self._count_lock:
            self._waiting_for_end += 1
        try:
            return self.notifier.wait_for(self._nothing_runs, timeout_sec)
        finally:
            with self._count_lock:
                self._waiting_for_end -= 1

    def _nothing_runs(self) -> bool:
        if self.workers.is_in_callback():
            return self.scheduler.running <= 1
        return not self.scheduler.running and self.workers.leader is None

    def _is_idle(self) -> bool:
        return not (
            self.registry.is_stale
            or self.poller.deadlines.jumped
            or self.scheduler.has_work()
            or not self._is_alive()
        )


class _OneCallback:
    """A worker's job for `spin_once`: to execute what may turn out to be nothing."""

    def __init__(self, execute: Callable[[Any], bool], work: Any) -> None:
        self._execute = execute
        self._work = work
        self._ran = True
        self._ended = threading.Lock()
        self._ended.acquire()

    def __call__(self, worker: Worker) -> None:
        worker.busy_since = begin = monotonic()
        self._ran = self._execute(self._work)
        worker.busy_since = 0.0
        self._work.slow = monotonic() - begin > TAKEOVER_SEC
        self._ended.release()

    def has_run(self, timeout_sec: float) -> bool:
        """Wait for the end; False only if there was nothing to run."""
        return not self._ended.acquire(timeout=timeout_sec) or self._ran
