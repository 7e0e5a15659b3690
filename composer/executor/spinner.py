"""What spinning is: puts the parts of one executor together, and lets them run."""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.executor.entity_registry import EntityRegistry
from composer.executor.event_loop import CallbackRunner, EventLoop, weakly
from composer.executor.scheduler import Session
from composer.executor.sources.event_source import ExecutorParts
from composer.executor.wait_set_thread import WaitSetThread
from composer.executor.worker_threads import TAKEOVER_SEC, WorkerThreads

GRACE_SEC = 0.05
"""How long `spin_once` waits for the callback that it began, and `spin` for those under way."""

_MAX_LOOK_SEC = 1.0
_MAX_END_SEC = 1.0


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
        parts: The parts of the executor.
        wait_set_thread: Sees what the poller does not.
        workers: Creates the threads, as `WorkerThreads` does.
    """

    def __init__(
        self,
        parts: ExecutorParts,
        wait_set_thread: WaitSetThread,
        workers: Callable[..., WorkerThreads] = WorkerThreads,
    ) -> None:
        self.poller = parts.poller
        self.scheduler = parts.scheduler
        self.notifier = Notifier()
        self.is_shutdown = False
        self.wait_set_thread = wait_set_thread
        wait_set_thread.serve(self)
        self.registry = EntityRegistry(parts, self.wait_set_thread)
        runner = CallbackRunner(parts)
        self._loop = EventLoop(
            parts, self.registry, runner, weakly(self.report), self.notifier.notify, workers
        )
        self.workers = self._loop.workers
        self.execute_at_once = self._loop.execute_at_once
        self._parts = parts
        self._waiting_callbacks: set[object] = set()
        self._are_callbacks_free = False
        self._errors: deque[BaseException] = deque()

    # Errors and wake-ups

    def report(self, error: BaseException) -> None:
        """Have `error` raised where the executor spins, unless it only means a lost context."""
        if isinstance(error, _rclpy.RCLError) and not self.is_context_valid():
            return
        self._errors.append(error)
        self.notifier.notify()

    def _takes_error(self, session: Session) -> bool:
        """Tell whether `session` raises an error: it takes the oldest that nobody raises yet."""
        if session.error is None:
            with suppress(IndexError):
                session.error = self._errors.popleft()
        return session.error is not None

    def _raise_error(self, session: Session) -> None:
        """Raise the error of `session`, if it takes one."""
        if self._takes_error(session):
            error, session.error = session.error, None
            try:
                raise error  # type: ignore[misc]
            finally:
                del error  # Its traceback has this frame.

    def wake(self) -> None:
        """Make the leader and all threads that wait look again."""
        self.poller.wake()
        self.notifier.notify()

    def _is_alive(self) -> bool:
        return not self.is_shutdown and self.is_context_valid()

    def is_context_valid(self) -> bool:
        """Like `Context.ok`, which waits while the context is being shut down."""
        handle: Any = self._parts.context.handle
        try:
            with handle:
                return bool(handle.ok())
        except InvalidHandle:
            return False

    # Spinning

    def spin(
        self, is_over: Callable[[], bool], timeout_sec: float | None, *, is_watched: bool = False
    ) -> None:
        """Let workers execute callbacks until `is_over()`, an error, a timeout or the end.

        Args:
            is_over: Whether to return; who makes it true calls `notifier.notify`.
            timeout_sec: None or negative for ever.
            is_watched: Whether callbacks may make `is_over()` true without that.
        """
        session = Session(admits_one=False)
        try:
            with self._open(session, is_watched=is_watched):
                self._wait_until_over(session, is_over, timeout_sec)
        finally:
            if not self.scheduler.is_spinning:
                self._wait_for_end(GRACE_SEC)
        self._raise_error(session)

    def spin_once(
        self, is_over: Callable[[], bool], timeout_sec: float | None, *, is_watched: bool = False
    ) -> None:
        """Let a worker execute one callback; stop waiting for one when `is_over()`."""
        session = Session(admits_one=True)
        with self._open(session, is_watched=is_watched):
            self._wait_until_over(session, is_over, timeout_sec)
        self._raise_error(session)

    @contextmanager
    def _open(self, session: Session, *, is_watched: bool) -> Iterator[None]:
        """Let callbacks begin by `session` meanwhile, in the place of one that spins itself."""
        self._raise_error(session)
        with self._parts.executor.waiting():
            try:
                self.wait_set_thread.add_user(session)
                if is_watched:
                    self._loop.watchers.add(session)
                self.scheduler.open_session(session)
                self.poller.wake()
                yield
            finally:
                self.scheduler.close_session(session)
                self._loop.watchers.discard(session)
                self.wait_set_thread.remove_user(session)

    def _wait_until_over(
        self, session: Session, is_over: Callable[[], bool], timeout_sec: float | None
    ) -> None:
        """Wait until `session` is over; until its callback has ended, if that takes no time."""

        def has_begun_or_is_over() -> bool:
            if session.work or self._takes_error(session) or not self._is_alive() or is_over():
                return True
            # There is none yet, or an error has ended it.
            self.workers.start()
            return False

        deadline = None if timeout_sec is None or timeout_sec < 0 else monotonic() + timeout_sec
        while True:
            left_sec = None if deadline is None else max(0.0, deadline - monotonic())
            if not self.notifier.wait_for(has_begun_or_is_over, left_sec):
                # What is ready runs, however short the time is.
                session.is_late = True
                self.notifier.wait_for(
                    lambda: session.has_looked or has_begun_or_is_over(), _MAX_LOOK_SEC
                )
            if not session.work:
                self.scheduler.close_session(session)
            work = session.work
            if work is None:
                return
            self.notifier.wait_for(
                lambda: session.has_ended or not session.work,
                TAKEOVER_SEC if work.slow else GRACE_SEC,
            )
            if session.work or session.is_closed:
                return

    def stop(self, timeout_sec: float | None) -> bool:
        """Begin no more callbacks, ever; returns whether those that ran have ended in time."""
        self.is_shutdown = True
        self.scheduler.close()
        self.wake()
        return self._wait_for_end(timeout_sec)

    def tear_down(self, *, wait_for_threads: bool) -> None:
        """Stop listening to all nodes, end the threads, and close what they waited for."""
        self.wait_set_thread.close()
        self.registry.drop_all()
        # Other callbacks that shut down, too, keep their threads a little longer.
        end_sec = GRACE_SEC if self.workers.is_in_callback() else _MAX_END_SEC
        self.workers.end(end_sec if wait_for_threads else 0.0, self.poller.close)

    def leave_to_parent(self) -> None:
        """Let nobody go on here: this is a forked child, and all of this belongs to its parent."""
        self.is_shutdown = self._parts.is_forked = True
        self.poller.leave_to_parent()
        self.workers.leave_to_parent()

    def _wait_for_end(self, timeout_sec: float | None) -> bool:
        """Wait until no callback runs, except those that wait here themselves."""
        me = object()
        has_ended = self._has_nothing_running
        self._loop.watchers.add(me)
        if self.workers.is_in_callback():
            has_ended = self._have_others_ended
            self._waiting_callbacks.add(me)
            self.notifier.notify()
        try:
            return self.notifier.wait_for(has_ended, timeout_sec)
        finally:
            self._loop.watchers.discard(me)
            self._waiting_callbacks.discard(me)

    def _has_nothing_running(self) -> bool:
        return not self.scheduler.running

    def _have_others_ended(self) -> bool:
        if self.scheduler.running <= len(self._waiting_callbacks):
            # After a shutdown nothing begins: what is true for one of them stays true for all.
            self._are_callbacks_free = self.is_shutdown
            return True
        return self._are_callbacks_free
