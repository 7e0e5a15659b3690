"""A thread with a wait set, for what rcl has no event callbacks for.

It waits for SIGINT and SIGTERM (through rclpy's guard condition), the nodes' guard conditions and
waitables of unknown kinds and QoS events, but not for those of which `qos_events` takes care. An
entity that was ready is left out of the wait set until it has run. A wait set with a QoS event of
a subscription wakes up for each of its messages, too; then the events are left out for a moment.
"""

import threading
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from time import monotonic
from typing import Any, Protocol

from rclpy.exceptions import InvalidHandle
from rclpy.waitable import NumberOfEntities

from composer.executor.sources.waitable_sources import (
    GuardConditionSource,
    QosEventSource,
    WaitableSource,
    WaitSetSource,
    create_wait_set,
    sizes_of,
)

_UNUSED_SEC = 0.25
_FLUSH_SEC = 1.0
# Whoever shuts the middleware down before the thread has left it crashes.
_END_SEC = 2.0
_PAUSE_SEC = 0.008
_MAX_EVENTS_SHARE = 0.02
# rclpy triggers its guard condition before it shuts the contexts down, in a thread that may be
# kept waiting in between (rclpy's signal_handler.cpp): for so long after a POSIX signal, the
# context is checked again and again.
_SIGNAL_SEC = 10.0
_SIGNAL_POLL_SEC = 0.005


class Owner(Protocol):
    """The executor, as its wait set thread sees it."""

    def report(self, error: BaseException) -> None:
        """Have `error` raised where the executor spins."""

    def wake(self) -> None:
        """Make all threads that wait look again."""

    def is_context_valid(self) -> bool:
        """Tell whether the context has not been shut down."""


class WaitSetThread:
    """The thread; it lives while the executor spins, and a little longer.

    Args:
        guard: A guard condition that wakes the thread.
        sigint_guard: The guard condition that rclpy triggers on SIGINT and SIGTERM.
        context: The rclpy context.
    """

    def __init__(self, guard: Any, sigint_guard: Any, context: Any) -> None:
        self._guard = guard
        self._sigint_guard = sigint_guard
        self._context = context
        self._owner: Owner
        self._lock = threading.RLock()  # A finalizer may close it.
        self._flushed = threading.Condition(self._lock)
        self._flush_requests = 0
        self._flushes = 0
        self._thread: threading.Thread | None = None
        self._closing = False
        self._users: set[object] = set()
        self._is_new = False
        self._waited_for: dict[WaitSetSource, None] = {}
        self._signalled_until = 0.0
        self._events_from = 0.0
        self._wait_set: tuple[tuple[int, ...], Any] | None = None

    def serve(self, owner: Owner) -> None:
        """Tell an executor what it sees, before it begins."""
        self._owner = owner

    def add(self, source: WaitSetSource) -> None:
        """Wait for the entity of `source`."""
        source.on_taken = self.wake
        with self._lock:
            self._waited_for[source] = None
        self.wake()

    def remove(self, source: WaitSetSource) -> None:
        """Undo `add`; when this returns, the thread does not wait for the entity."""
        with self._lock:
            self._waited_for.pop(source, None)
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
                self._is_new = True
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
        """`flush` if there is anything to wait for, or the thread has just begun.

        Its first round keeps the GIL for milliseconds, which must not be those of a callback.
        """
        if self._waited_for or self._is_new:
            self._is_new = False
            self.flush()

    def close(self) -> None:
        """End the thread."""
        with self._lock:
            self._closing = True
            thread = self._thread
        self.wake()
        if thread is not None and thread is not threading.current_thread():
            thread.join(_END_SEC)

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
            if requests > self._flushes:
                with self._flushed:
                    self._flushes = requests
                    self._flushed.notify_all()

    def _wait(self, max_sec: float | None) -> None:
        begin = monotonic()
        pause_sec = self._events_from - begin
        if pause_sec > 0:
            max_sec = pause_sec if max_sec is None else min(max_sec, pause_sec)
        timeout_sec = self._timeout_sec(max_sec)
        with ExitStack() as held, suppress(InvalidHandle):
            held.enter_context(self._guard.handle)
            held.enter_context(self._sigint_guard.handle)
            sources = self._hold_sources(held, with_events=pause_sec <= 0)
            wait_set = self._fill_wait_set(sources)
            held.enter_context(wait_set)
            waits_since = monotonic()
            wait_set.wait(-1 if timeout_sec is None else int(timeout_sec * 1e9))
            woken = monotonic()
            triggered = set(wait_set.get_ready_entities('guard_condition'))
            ready = [source for source in sources if _was_ready(source, wait_set, triggered)]
            for source in ready:
                source.set_ready()
            if self._sigint_guard.handle.pointer in triggered:
                self._signalled_until = monotonic() + _SIGNAL_SEC
                self._owner.wake()
            if not (ready or triggered) and any(isinstance(s, QosEventSource) for s in sources):
                cost_sec = waits_since - begin + monotonic() - woken
                self._events_from = woken + max(_PAUSE_SEC, cost_sec / _MAX_EVENTS_SHARE)

    def _hold_sources(self, held: ExitStack, *, with_events: bool) -> list[WaitSetSource]:
        """Return the sources to wait for, whose entities are not destroyed while `held`."""
        sources = []
        for source in tuple(self._waited_for):
            if (with_events or not isinstance(source, QosEventSource)) and source.alive:
                with suppress(InvalidHandle):
                    if not source.entity._executor_event:  # noqa: SLF001
                        held.enter_context(_handle_of(source))
                        sources.append(source)
        return sources

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
        if monotonic() < self._signalled_until:
            return _SIGNAL_POLL_SEC if max_sec is None else min(max_sec, _SIGNAL_POLL_SEC)
        return max_sec


def _handle_of(source: WaitSetSource) -> Any:
    if isinstance(source, WaitableSource):
        return source.entity
    return source.entity.handle


def _was_ready(source: WaitSetSource, wait_set: Any, triggered: set[int]) -> bool:
    if isinstance(source, WaitableSource):
        return bool(source.entity.is_ready(wait_set))
    return source.entity.handle.pointer in triggered
