"""The parts of one executor together, and the leader's loop."""

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.runtime.executor.alarms import Alarms, Delay
from composer.runtime.executor.crew import PATIENCE_SEC, Crew, Worker
from composer.runtime.executor.execution import Execution
from composer.runtime.executor.lane import Lane
from composer.runtime.executor.news import News
from composer.runtime.executor.registry import Registry
from composer.runtime.executor.schedule import Schedule
from composer.runtime.executor.signals import SignalBoard
from composer.runtime.executor.sources import Desk

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
        self.schedule = Schedule(most_at_once, self.wake_poll)
        self.alarms = Alarms(self.wake_poll)
        self.execution = Execution(executor, self.schedule, self.alarms)
        self.news = News()
        self.executor = executor
        self.is_shutdown = False
        self._board = SignalBoard()
        self._board.add(self.alarms.timer.fd, self.alarms)
        desk = Desk(executor, self.schedule, self._board, self.alarms)
        self.lane = Lane(desk, guard, sigint_guard, self)
        desk.look_again = self.lane.look_again
        self.registry = Registry(desk, self.lane)
        self.crew = Crew(self._lead)
        self._pollers: set[int] = set()
        self._sessions = 0
        self._session_lock = threading.Lock()
        self._settling = 0
        self._errors: deque[BaseException] = deque()
        self._put_off: Delay | None = None

    # Errors and news

    def report(self, error: BaseException) -> None:
        """Have `error` raised where the executor spins, unless it tells of a lost context."""
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
        self.wake_poll()
        self.news.tell()

    def wake_poll(self) -> None:
        """Have the leader look again."""
        if self._pollers:
            self._board.wake()

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
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        self.lane.enter()
        try:
            self._look_at_everything()
            while self.is_alive() and not condition() and not self._run_one():
                left = None if deadline is None else deadline - time.monotonic()
                if left is not None and left <= 0:
                    break
                self._await_work(left)
        finally:
            self.lane.leave()
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
        self.is_shutdown = True
        self.schedule.admitting = False
        self.wake()
        return self.settle(timeout_sec)

    def _enter(self) -> None:
        self.lane.enter()
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
        self.lane.leave()
        if last:
            self.wake_poll()
            self.settle(COURTESY_SEC)

    def _look_at_everything(self) -> None:
        if self.registry.is_stale:
            self.registry.refresh(self.executor.get_nodes())
        self.lane.flush_for_taking()
        self.execution.resume_paused()
        self._peek()

    def _await_work(self, timeout_sec: float | None) -> None:
        if self._sessions:  # Another thread leads, and may take the announcement or the wake-up.
            timeout_sec = COURTESY_SEC if timeout_sec is None else min(timeout_sec, COURTESY_SEC)
        self._poll_if(self._has_nothing, timeout_sec)
        self.alarms.follow_jumps()
        if self.registry.is_stale:
            self.registry.refresh(self.executor.get_nodes())

    def _run_one(self) -> bool:
        """Have a worker run one callback, if one is ready, and wait a little for its end."""
        while (work := self.schedule.claim(alone=True)) is not None:
            attempt = _Attempt(self._execute, work)
            self.crew.dispatch(attempt)
            if attempt.has_run(PATIENCE_SEC if getattr(work, 'slow', False) else COURTESY_SEC):
                return True
        return False

    def _is_quiet(self) -> bool:
        if self.crew.is_in_callback():
            return self.schedule.executing <= 1
        return not self.schedule.executing and self.crew.leader is None

    # The leader

    def _lead(self, me: Worker) -> None:
        try:
            while self.crew.leads(me, self._is_admitting):
                if self._execute_ready(me) or self.schedule.executing:
                    if self._peek() or not self._leader_has_nothing():
                        continue
                    if self.schedule.executing:
                        self.crew.end_watch(me)
                if self.crew.leader is me:
                    self._poll_if(self._leader_has_nothing, None)
                    self.alarms.follow_jumps()
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            self.schedule.admitting = False
            self.crew.leads(me, self._is_admitting)
            self.report(error)
        self.news.tell()

    def _execute_ready(self, me: Worker) -> bool:
        """Execute about what is ready now; False if there is no more, or `me` was replaced."""
        crew, schedule = self.crew, self.schedule
        for _ in range(max(1, len(schedule))):
            if self.registry.is_stale:
                self._refresh()
            work = schedule.claim()
            if work is None:
                return False
            crew.begin(me)
            if work.slow:
                crew.pass_on(me)
            self._execute(work)
            work.slow = time.monotonic() - me.busy_since > PATIENCE_SEC
            me.busy_since = 0.0
            if crew.leader is not me:
                return False
        return True

    def _execute(self, work: Any) -> bool:
        ran = self.execution.execute(work)
        if self._pollers and len(self.schedule):
            self._board.wake()
        if self._settling:
            self.news.tell()
        return ran

    def _refresh(self) -> None:
        rest_sec = self.registry.rest_sec()
        if not rest_sec:
            self.registry.refresh(self.executor.get_nodes())
        elif self._put_off is None:
            self._put_off = Delay(self.alarms, rest_sec, self._end_rest)

    def _end_rest(self) -> None:
        self._put_off = None

    def _peek(self) -> bool:
        arrived = self._board.peek()
        self._board.deliver(arrived)
        self.alarms.follow_jumps()
        return bool(arrived)

    def _poll_if(self, has_nothing: Callable[[], bool], timeout_sec: float | None) -> None:
        """Wait for events; whoever makes `has_nothing()` false meanwhile calls `wake_poll`."""
        me = threading.get_ident()
        self._pollers.add(me)
        try:
            arrived = self._board.wait(timeout_sec if has_nothing() else 0)
        finally:
            self._pollers.discard(me)
        self._board.deliver(arrived)

    def _has_nothing(self) -> bool:
        schedule = self.schedule
        return not (
            self.registry.is_stale
            or self.alarms.jumped
            or (len(schedule) and schedule.can_admit())
        )

    def _leader_has_nothing(self) -> bool:
        schedule = self.schedule
        return not (
            (self.registry.is_stale and self._put_off is None)
            or self.alarms.jumped
            or not schedule.admitting
            or (len(schedule) and schedule.can_admit())
        )

    def _is_admitting(self) -> bool:
        return self.schedule.admitting

    def tear_down(self, nodes: list[Any]) -> None:
        """Let go of the entities of `nodes`, the threads and what they waited for."""
        for node in nodes:
            with suppress(InvalidHandle):
                self.registry.drop(node)
        self.lane.close()
        self.crew.dismiss(COURTESY_SEC)
        if not self.crew.is_manned():
            self._board.close()
            self.alarms.timer.close()


class _Attempt:
    """A worker's job: to execute one piece of work that may turn out to be nothing."""

    def __init__(self, execute: Callable[[Any], bool], work: Any) -> None:
        self._execute = execute
        self._work = work
        self._ran = True
        self._over = threading.Lock()
        self._over.acquire()

    def __call__(self, worker: Worker) -> None:
        worker.busy_since = begin = time.monotonic()
        self._ran = self._execute(self._work)
        worker.busy_since = 0.0
        self._work.slow = time.monotonic() - begin > PATIENCE_SEC
        self._over.release()

    def has_run(self, timeout_sec: float) -> bool:
        """Wait for the end; False only if there was nothing to run."""
        return not self._over.acquire(timeout=timeout_sec) or self._ran
