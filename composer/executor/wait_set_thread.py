"""A thread with a wait set, for what rcl has no event callbacks for.

It waits for SIGINT and SIGTERM (through rclpy's guard condition), the nodes' guard conditions and
waitables of unknown kinds. It does not wait for QoS events, because a wait set with an event of a
subscription wakes up for each of its messages. It checks them from time to time: often in general,
but seldom those with rclpy's default callbacks, which log incompatible QoS, and with callbacks
marked `checked_seldom`; these are checked soon after entities were created or destroyed. An entity
that was ready is left out of the wait set until it has run.
"""

import threading
from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
from time import monotonic
from typing import Any, Protocol, TypeVar

from rclpy.event_handler import EventHandler
from rclpy.exceptions import InvalidHandle
from rclpy.waitable import NumberOfEntities

from composer.executor.sources.waitable_sources import (
    GuardConditionSource,
    WaitableSource,
    WaitSetSource,
    create_wait_set,
    is_ready,
    sizes_of,
)

_UNUSED_SEC = 1.0
_SOON_SEC = 0.01
_SOON_INTERVAL_SEC = 0.2
_SOON_TIMES = 3
_REST_FACTOR = 10
_FLUSH_SEC = 1.0
# rclpy triggers its guard condition before it shuts the contexts down, in a thread that may be
# kept waiting in between (rclpy's signal_handler.cpp): for so long after a POSIX signal, the
# context is checked again and again.
_SIGNAL_SEC = 10.0
_SIGNAL_POLL_SEC = 0.005

_Callback = TypeVar('_Callback', bound=Callable[..., Any])


def checked_seldom(callback: _Callback) -> _Callback:
    """Mark a callback of QoS events that need not run at once; a decorator."""
    marked: Any = callback
    marked.is_checked_seldom = True
    return callback


def _is_checked_seldom(callback: Any) -> bool:
    # The module defines rclpy's default callbacks.
    is_default = getattr(callback, '__module__', '') == 'rclpy.event_handler'
    return is_default or getattr(callback, 'is_checked_seldom', False)


class Owner(Protocol):
    """The executor, as its wait set thread sees it."""

    def report(self, error: BaseException) -> None:
        """Have `error` raised where the executor spins."""

    def wake(self) -> None:
        """Make all threads that wait look again."""

    def is_context_valid(self) -> bool:
        """Tell whether the context has not been shut down."""


class _QosEventChecks:
    """QoS events that are checked one by one, at an interval that keeps the cost low.

    Args:
        min_sec: The shortest interval.
        max_sec: The longest interval.
        share: The share of the time that checks may take.
    """

    def __init__(self, min_sec: float, max_sec: float, share: float) -> None:
        self.sources: set[WaitSetSource] = set()
        self.due = 0.0
        self._not_before = 0.0
        self._soon_left = 0
        self._min_sec = min_sec
        self._max_sec = max_sec
        self._share = share

    def run(self, wait_set: Any) -> None:
        """Queue the events that have happened."""
        begin = monotonic()
        for source in tuple(self.sources):
            if source.entity._executor_event or not source.alive:  # noqa: SLF001
                continue
            with suppress(InvalidHandle), source.entity:
                if is_ready(source.entity, wait_set):
                    source.set_ready()
        end = monotonic()
        self._not_before = end + _REST_FACTOR * (end - begin)
        pause = min(self._max_sec, max(self._min_sec, (end - begin) / self._share))
        if self._soon_left:
            self._soon_left -= 1
            pause = min(pause, _SOON_INTERVAL_SEC)
        self.due = max(end + pause, self._not_before)

    def run_soon(self) -> None:
        """Check a few times in the next moments, without using more than a tenth of the time."""
        self._soon_left = _SOON_TIMES
        self.due = min(self.due, max(monotonic() + _SOON_SEC, self._not_before))


class WaitSetThread:
    """The thread; it lives while the executor spins, and a little longer.

    Args:
        guard: A guard condition that wakes the thread.
        sigint_guard: The guard condition that rclpy triggers on SIGINT and SIGTERM.
        context: The rclpy context.
        owner: The executor.
    """

    def __init__(self, guard: Any, sigint_guard: Any, context: Any, owner: Owner) -> None:
        self._guard = guard
        self._sigint_guard = sigint_guard
        self._context = context
        self._owner = owner
        self._lock = threading.Lock()
        self._flushed = threading.Condition(self._lock)
        self._flush_requests = 0
        self._flushes = 0
        self._thread: threading.Thread | None = None
        self._closing = False
        self._users: set[object] = set()
        self._waited_for: set[WaitSetSource] = set()
        self._often = _QosEventChecks(0.02, 1.0, 0.01)
        self._seldom = _QosEventChecks(0.1, 30.0, 0.002)
        self._signalled_until = 0.0
        self._wait_set: tuple[tuple[int, ...], Any] | None = None

    def add(self, source: WaitSetSource) -> None:
        """Wait for the entity of `source`, or check it from time to time."""
        if not isinstance(source.entity, EventHandler):
            source.on_taken = self.wake
        with self._lock:
            self._sources_like(source).add(source)
        self.wake()

    def remove(self, source: WaitSetSource) -> None:
        """Undo `add`; when this returns, the thread does not wait for the entity."""
        with self._lock:
            self._sources_like(source).discard(source)
        if isinstance(source.entity, EventHandler):
            return
        self.flush()

    def add_user(self, user: object) -> None:
        """Run until `remove_user`.

        Raises:
            RuntimeError: The process may have no more threads.
        """
        with self._lock:
            self._users.add(user)
            if self._thread is None and not self._closing:
                self._thread = threading.Thread(
                    target=self._run, name='executor-wait-set', daemon=True
                )
                try:
                    self._thread.start()
                except RuntimeError:
                    self._thread = None
                    raise

    def remove_user(self, user: object) -> None:
        """Undo `add_user`."""
        with self._lock:
            self._users.discard(user)

    def wake(self) -> None:
        """Make the thread look at its sources again."""
        if self._thread is not None:
            with suppress(InvalidHandle):
                self._guard.trigger()

    def check_events_soon(self) -> None:
        """Check all QoS events a few times in the next moments: entities have come or gone."""
        used = [checks for checks in (self._seldom, self._often) if checks.sources]
        for checks in used:
            checks.run_soon()
        if used:
            self.wake()

    def flush(self) -> None:
        """Return when all that was triggered before is queued."""
        with self._lock:
            thread = self._thread
            if thread is None or thread is threading.current_thread() or self._closing:
                return
            self._flush_requests += 1
            request = self._flush_requests
        self.wake()
        with self._flushed:
            self._flushed.wait_for(
                lambda: self._flushes >= request or self._thread is None, _FLUSH_SEC
            )

    def flush_if_used(self) -> None:
        """`flush` if there is anything to wait for."""
        if self._waited_for:
            self.flush()

    def close(self) -> None:
        """End the thread."""
        with self._lock:
            self._closing = True
            thread = self._thread
        self.wake()
        if thread is not None and thread is not threading.current_thread():
            thread.join(_FLUSH_SEC)

    def reset_after_fork(self) -> None:
        """Forget the thread, which is not in the child."""
        self._closing = True
        self._thread = None

    def _sources_like(self, source: WaitSetSource) -> set[WaitSetSource]:
        if not isinstance(source.entity, EventHandler):
            return self._waited_for
        callback = source.entity.callback
        return (self._seldom if _is_checked_seldom(callback) else self._often).sources

    def _run(self) -> None:
        try:
            self._wait_and_check()
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            self._owner.report(error)
        finally:
            with self._flushed:
                if self._thread is threading.current_thread():
                    self._thread = None
                self._flushed.notify_all()
            self._owner.wake()  # Also after an error that only meant a lost context.

    def _wait_and_check(self) -> None:
        unused_since: float | None = None
        while True:
            with self._lock:
                requests = self._flush_requests
                unused = not self._users
                if not unused:
                    unused_since = None
                elif unused_since is None:
                    unused_since = monotonic()
                over = unused_since is not None and (monotonic() - unused_since >= _UNUSED_SEC)
                if self._closing or over or not self._owner.is_context_valid():
                    self._thread = None
                    self._wait_set = None
                    return
            # `flush` is waiting, and its wake-up may have ended the wait before this one.
            self._wait(0 if requests > self._flushes else _UNUSED_SEC if unused else None)
            self._check_events()
            if requests > self._flushes:
                with self._flushed:
                    self._flushes = requests
                    self._flushed.notify_all()

    def _wait(self, max_sec: float | None) -> None:
        timeout_sec = self._timeout_sec(max_sec)
        timeout_ns = -1 if timeout_sec is None else int(timeout_sec * 1e9)
        with ExitStack() as held, suppress(InvalidHandle):
            held.enter_context(self._guard.handle)
            held.enter_context(self._sigint_guard.handle)
            sources = []
            for source in tuple(self._waited_for):
                with suppress(InvalidHandle):
                    if source.alive and not source.entity._executor_event:  # noqa: SLF001
                        held.enter_context(_handle_of(source))
                        sources.append(source)
            wait_set = self._fill_wait_set(sources)
            held.enter_context(wait_set)
            wait_set.wait(timeout_ns)
            triggered = set(wait_set.get_ready_entities('guard_condition'))
            for source in sources:
                if _was_ready(source, wait_set, triggered):
                    source.set_ready()
            if self._sigint_guard.handle.pointer in triggered:
                self._signalled_until = monotonic() + _SIGNAL_SEC
                self._owner.wake()

    def _fill_wait_set(self, sources: Iterable[WaitSetSource]) -> Any:
        """Return a wait set with the thread's guard conditions and `sources` in it."""
        count: Any = NumberOfEntities(num_gcs=2)
        for source in sources:
            if isinstance(source, GuardConditionSource):
                count.num_guard_conditions += 1
            else:
                count += source.entity.get_num_entities()
        sizes = sizes_of(count)
        if self._wait_set is None or self._wait_set[0] != sizes:
            self._wait_set = (sizes, create_wait_set(sizes, self._context))
        wait_set = self._wait_set[1]
        with wait_set:
            wait_set.clear_entities()
            wait_set.add_guard_condition(self._guard.handle)
            wait_set.add_guard_condition(self._sigint_guard.handle)
            for source in sources:
                if isinstance(source, GuardConditionSource):
                    wait_set.add_guard_condition(source.entity.handle)
                else:
                    source.entity.add_to_wait_set(wait_set)
        return wait_set

    def _timeout_sec(self, max_sec: float | None) -> float | None:
        now = monotonic()
        ends = [c.due for c in (self._often, self._seldom) if c.sources]
        if max_sec is not None:
            ends.append(now + max_sec)
        if now < self._signalled_until:
            ends.append(now + _SIGNAL_POLL_SEC)
        return max(0.0, min(ends) - now) if ends else None

    def _check_events(self) -> None:
        now = monotonic()
        due = [
            checks
            for checks in (self._often, self._seldom)
            if checks.sources and checks.due <= now
        ]
        if not due:
            return
        with suppress(InvalidHandle):
            wait_set = create_wait_set((0, 0, 0, 0, 0, 1), self._context)
            for checks in due:
                checks.run(wait_set)


def _handle_of(source: WaitSetSource) -> Any:
    if isinstance(source, WaitableSource):
        return source.entity
    return source.entity.handle


def _was_ready(source: WaitSetSource, wait_set: Any, triggered: set[int]) -> bool:
    if isinstance(source, WaitableSource):
        return bool(source.entity.is_ready(wait_set))
    return source.entity.handle.pointer in triggered
