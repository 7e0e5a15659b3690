"""The parts of one executor together, and what spinning is."""

import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.executor.after_fork import end_child, free_locks
from composer.executor.entity_registry import Registry
from composer.executor.event_loop import Execution
from composer.executor.event_source import Desk
from composer.executor.leader import Leader
from composer.executor.news import News
from composer.executor.polling import Polling
from composer.executor.scheduler import Schedule
from composer.executor.switch_interval import prompt_switching
from composer.executor.wait_set_thread import Lane
from composer.executor.worker_threads import PATIENCE_SEC, Crew, Worker

COURTESY_SEC = 0.05
"""How long `spin_once` waits for the callback that it began, and `spin` for those under way."""


class Engine:
    """Everything behind the executor's face.

    Args:
        executor: The executor that futures are told of; it has `context` and `get_nodes()`.
        most_at_once: How many callbacks may run at the same time.
        guard: A guard condition that the lane may use.
        sigint_guard: The guard condition that rclpy triggers on signals.
    """

    def __init__(self, executor: Any, most_at_once: int, guard: Any, sigint_guard: Any) -> None:
        self.polling = Polling()
        self.schedule = Schedule(most_at_once, self.polling.wake)
        self.alarms = self.polling.alarms
        self.execution = Execution(executor, self.schedule, self.alarms)
        self.news = News()
        self.executor = executor
        self.is_shutdown = False
        desk = Desk(executor, self.schedule, self.polling.board, self.alarms)
        self.lane = Lane(desk, guard, sigint_guard, self)
        desk.look_again = self.lane.look_again
        desk.peek = self.polling.peek
        self.registry = Registry(desk, self.lane)
        self.crew = Crew(Leader(self).lead, self.report)
        self._sessions = 0
        self._loners = 0
        self._session_lock = threading.Lock()
        self._settling = 0
        self._errors: deque[BaseException] = deque()

    # Errors and news

    def report(self, error: BaseException) -> None:
        """Have `error` raised where the executor spins, unless it tells of a lost context."""
        if self.crew.is_inherited:
            end_child(error)
        if isinstance(error, _rclpy.RCLError) and not self.context_is_valid():
            return
        self._errors.append(error)
        self.news.tell()

    def raise_error(self) -> None:
        """Raise the oldest error that was reported and not raised yet."""
        if self._errors:
            raise self._errors.popleft()

    def wake(self) -> None:
        """Have the leader and all who wait look again."""
        self.polling.wake()
        self.news.tell()

    def is_alive(self) -> bool:
        """Tell whether there is anything to spin for."""
        return not self.is_shutdown and self.context_is_valid()

    def context_is_valid(self) -> bool:
        """Like `Context.ok`, which waits while the context is being shut down."""
        handle: Any = self.executor.context.handle
        try:
            with handle:
                return bool(handle.ok())
        except InvalidHandle:
            return False

    # Spinning

    def spin_until(self, condition: Callable[[], bool], timeout_sec: float | None) -> None:
        """Let the crew execute callbacks until `condition()`, an error, a timeout or the end."""
        self.raise_error()
        self._enter()
        try:
            self.news.wait_for(
                lambda: bool(self._errors) or condition() or not self.is_alive(), timeout_sec
            )
        finally:
            self._leave()
        self.raise_error()

    def spin_once(self, condition: Callable[[], bool], timeout_sec: float | None) -> None:
        """Let a worker execute one callback."""
        self.raise_error()
        if timeout_sec is not None and timeout_sec < 0:
            timeout_sec = None
        deadline = None if timeout_sec is None else monotonic() + timeout_sec
        self.lane.enter()
        with self._session_lock:
            self._loners += 1
        try:
            if self.is_alive():
                self._look_at_everything()
            while self.is_alive() and not condition() and not self._run_one():
                left = None if deadline is None else deadline - monotonic()
                if left is not None and left <= 0:
                    break
                self._await_work(left)
        finally:
            with self._session_lock:
                self._loners -= 1
            self.lane.leave()
            if self.is_shutdown:
                self.news.tell()
        self.raise_error()

    def settle(self, timeout_sec: float | None) -> bool:
        """Wait until no callback runs, except that from which this is called."""
        with self._session_lock:
            self._settling += 1
        try:
            return self.news.wait_for(self._is_quiet, timeout_sec)
        finally:
            with self._session_lock:
                self._settling -= 1

    def stop(self, timeout_sec: float | None) -> bool:
        """Begin no more callbacks, ever; returns whether those that ran have ended in time."""
        with self._session_lock:
            self.is_shutdown = True
            self.schedule.close()
        self.wake()
        return self.settle(timeout_sec)

    def _enter(self) -> None:
        self.lane.enter()
        prompt_switching.enter()
        with self._session_lock:
            self._sessions += 1
            self.schedule.admitting = not self.is_shutdown
        if self.schedule.admitting:
            self.crew.muster()

    def _leave(self) -> None:
        with self._session_lock:
            self._sessions -= 1
            last = not self._sessions
            if last:
                self.schedule.admitting = False
        prompt_switching.leave()
        self.lane.leave()
        if last:
            self.polling.wake()
            self.settle(COURTESY_SEC)

    def _look_at_everything(self) -> None:
        if self.registry.is_stale:
            self.registry.refresh(self.executor.get_nodes())
        self.lane.flush_for_taking()
        self.execution.resume_paused()
        self.polling.peek()

    def _await_work(self, timeout_sec: float | None) -> None:
        if self._sessions:  # Another thread leads, and may take the announcement or the wake-up.
            timeout_sec = COURTESY_SEC if timeout_sec is None else min(timeout_sec, COURTESY_SEC)
        self.polling.wait_if(self._has_nothing, timeout_sec)
        if self.registry.is_stale:
            self.registry.refresh(self.executor.get_nodes())

    def _run_one(self) -> bool:
        """Have a worker run one callback, if one is ready, and wait a little for its end."""
        while (work := self.schedule.claim(alone=True)) is not None:
            attempt = _Attempt(self.execute, work)
            self.crew.dispatch(attempt)
            if attempt.has_run(PATIENCE_SEC if getattr(work, 'slow', False) else COURTESY_SEC):
                return True
        return False

    def _is_quiet(self) -> bool:
        if self.crew.is_in_callback():
            return self.schedule.executing <= 1
        return not self.schedule.executing and self.crew.leader is None

    def execute(self, work: Any) -> bool:
        """Execute what was claimed; False if there was nothing to take."""
        ran = self.execution.execute(work)
        if len(self.schedule):
            self.polling.wake()
        if self._settling:
            self.news.tell()
        return ran

    def _has_nothing(self) -> bool:
        schedule = self.schedule
        return not (
            self.registry.is_stale
            or self.polling.alarms.jumped
            or (len(schedule) and schedule.can_admit())
            or not self.is_alive()
        )

    def leave_to_parent(self) -> None:
        """Be shut down: this process was forked, and all of this is its parent's."""
        free_locks((self, self.executor, self.schedule, self.alarms, self.polling.board))
        free_locks((self.news, self.lane, self.registry, self.crew))
        self.is_shutdown = True
        self.schedule.leave_to_parent(int(self.crew.is_in_callback()))
        for part in (self.polling, self.lane, self.registry, self.crew):
            part.leave_to_parent()

    def tear_down(self, nodes: list[Any]) -> None:
        """Let go of the entities of `nodes`, the threads and what they waited for."""
        for node in nodes:
            with suppress(InvalidHandle):
                self.registry.drop(node)
        self.lane.close()
        self.crew.dismiss(COURTESY_SEC)
        if not self.crew.is_in_callback():
            self.news.wait_for(lambda: not self._loners, COURTESY_SEC)
        if not self._loners and not self.crew.is_manned():
            self.polling.close()


class _Attempt:
    """A worker's job: to execute one piece of work that may turn out to be nothing."""

    def __init__(self, execute: Callable[[Any], bool], work: Any) -> None:
        self._execute = execute
        self._work = work
        self._ran = True
        self._over = threading.Lock()
        self._over.acquire()

    def __call__(self, worker: Worker) -> None:
        worker.busy_since = begin = monotonic()
        self._ran = self._execute(self._work)
        worker.busy_since = 0.0
        self._work.slow = monotonic() - begin > PATIENCE_SEC
        self._over.release()

    def has_run(self, timeout_sec: float) -> bool:
        """Wait for the end; False only if there was nothing to run."""
        return not self._over.acquire(timeout=timeout_sec) or self._ran
