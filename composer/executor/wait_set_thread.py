"""A thread with a wait set, for what rcl does not announce.

It waits for SIGINT and SIGTERM (through rclpy's guard condition), the nodes' guard conditions
and waitables of unknown kinds, and looks at the QoS events from time to time: those given by the
user often, rclpy's default handlers (which log incompatible QoS) seldom, but soon after entities
were created or destroyed. Waiting for events is no choice: a wait set with an event of a
subscription wakes up for each of its messages. What has been announced is left out of the wait
set until it has run.
"""

import threading
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from time import monotonic
from typing import Any

from rclpy.event_handler import EventHandler
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.waitable import NumberOfEntities

from composer.executor.event_source import Desk, Source
from composer.executor.waitable_sources import (
    GuardConditionSource,
    PolledSource,
    WaitableSource,
    look,
)

_UNUSED_SEC = 1.0
_SOON_SEC = 0.01
_HURRIED_SEC = 0.2
_HURRIED_TIMES = 3
_REST_SHARE = 10
_ANSWER_SEC = 1.0
# rclpy tells of a signal before it shuts the contexts down, in a thread that may be kept waiting
# in between (rclpy's signal_handler.cpp): for so long after a signal, the context is looked at.
_SIGNAL_SEC = 10.0
_SIGNAL_POLL_SEC = 0.005


class _EventWatch:
    """QoS events that are looked at one by one, at an interval that keeps their cost low."""

    def __init__(self, least_sec: float, most_sec: float, share: float) -> None:
        self.sources: set[PolledSource] = set()
        self.due = 0.0
        self._soonest = 0.0
        self._hurried = 0
        self._least_sec = least_sec
        self._most_sec = most_sec
        self._share = share

    def sweep(self, wait_set: Any) -> None:
        """Announce the events that have happened."""
        begin = monotonic()
        for source in tuple(self.sources):
            if source.entity._executor_event or not source.alive:  # noqa: SLF001
                continue
            with suppress(InvalidHandle), source.entity:
                if look(source.entity, wait_set):
                    source.announce()
        end = monotonic()
        self._soonest = end + _REST_SHARE * (end - begin)
        pause = min(self._most_sec, max(self._least_sec, (end - begin) / self._share))
        if self._hurried:
            self._hurried -= 1
            pause = min(pause, _HURRIED_SEC)
        self.due = max(end + pause, self._soonest)

    def hurry(self) -> None:
        """Look a few times in the next moments, without spending more than a tenth of the time."""
        self._hurried = _HURRIED_TIMES
        self.due = min(self.due, max(monotonic() + _SOON_SEC, self._soonest))


class Lane:
    """The thread; it lives while someone spins and a little longer."""

    def __init__(self, desk: Desk, guard: Any, sigint_guard: Any, engine: Any) -> None:
        self._desk = desk
        self._engine = engine
        self._guard = guard
        self._sigint_guard = sigint_guard
        self._lock = threading.Lock()
        self._answered = threading.Condition(self._lock)
        self._asked = 0
        self._answer = 0
        self._thread: threading.Thread | None = None
        self._closing = False
        self._users = 0
        self._waited_for: set[PolledSource] = set()
        self._given = _EventWatch(0.02, 1.0, 0.01)
        self._default = _EventWatch(0.1, 30.0, 0.002)
        self._signalled_until = 0.0
        self._wait_set: tuple[tuple[int, ...], Any] | None = None

    def add(self, source: PolledSource) -> None:
        """Watch `source`."""
        with self._lock:
            self._place_of(source).add(source)
        self.poke()

    def remove(self, source: PolledSource) -> None:
        """Watch `source` no more; when this returns, it is not being waited for."""
        with self._lock:
            self._place_of(source).discard(source)
        if isinstance(source.entity, EventHandler):
            return
        self.flush()

    def enter(self) -> None:
        """Be there until `leave`."""
        with self._lock:
            self._users += 1
            if self._thread is None and not self._closing:
                self._thread = threading.Thread(
                    target=self._run, name='executor-lane', daemon=True
                )
                self._thread.start()

    def leave(self) -> None:
        """End what `enter` began."""
        with self._lock:
            self._users -= 1

    def poke(self) -> None:
        """Look at the sources anew."""
        if self._thread is not None:
            with suppress(InvalidHandle):
                self._guard.trigger()

    def look_soon(self) -> None:
        """Look at all events a few times in the next moments, for entities have come or gone."""
        watches = [watch for watch in (self._default, self._given) if watch.sources]
        for watch in watches:
            watch.hurry()
        if watches:
            self.poke()

    def look_again(self, source: Source) -> None:
        """Wait again for `source`, which has been taken."""
        if not isinstance(source.entity, EventHandler):
            self.poke()

    def flush(self) -> None:
        """Return when all that was triggered before has been announced."""
        with self._lock:
            thread = self._thread
            if thread is None or thread is threading.current_thread() or self._closing:
                return
            self._asked += 1
            asked = self._asked
        self.poke()
        with self._answered:
            self._answered.wait_for(
                lambda: self._answer >= asked or self._thread is None, _ANSWER_SEC
            )

    def flush_for_taking(self) -> None:
        """`flush`, where there is something that must not be overlooked."""
        if self._waited_for:
            self.flush()

    def close(self) -> None:
        """End the thread."""
        with self._lock:
            self._closing = True
            thread = self._thread
        self.poke()
        if thread is not None and thread is not threading.current_thread():
            thread.join(_ANSWER_SEC)

    def leave_to_parent(self) -> None:
        """Be without the thread."""
        self._closing = True
        self._thread = None

    def _place_of(self, source: PolledSource) -> set[PolledSource]:
        if not isinstance(source.entity, EventHandler):
            return self._waited_for
        name = getattr(source.entity.callback, '__name__', '')
        watch = self._default if name.startswith('_default_') else self._given
        return watch.sources

    def _run(self) -> None:
        try:
            self._wait_and_look()
        except BaseException as error:  # noqa: BLE001 (raised again where the executor spins)
            self._engine.report(error)
        finally:
            with self._answered:
                if self._thread is threading.current_thread():
                    self._thread = None
                self._answered.notify_all()
            self._engine.wake()  # Also after an error that only told of a lost context.

    def _wait_and_look(self) -> None:
        unused_since: float | None = None
        while True:
            with self._lock:
                asked = self._asked
                unused = self._users == 0
                if not unused:
                    unused_since = None
                elif unused_since is None:
                    unused_since = monotonic()
                over = unused_since is not None and (monotonic() - unused_since >= _UNUSED_SEC)
                if self._closing or over or not self._engine.context_is_valid():
                    self._thread = None
                    self._wait_set = None
                    return
            # Whoever asked is waiting, and the poke may have been spent on the wait before.
            self._wait(0 if asked > self._answer else _UNUSED_SEC if unused else None)
            self._sweep()
            if asked > self._answer:
                with self._answered:
                    self._answer = asked
                    self._answered.notify_all()

    def _wait(self, most_sec: float | None) -> None:
        timeout_sec = self._timeout(most_sec)
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
            wait_set = self._filled(sources)
            held.enter_context(wait_set)
            wait_set.wait(timeout_ns)
            triggered = set(wait_set.get_ready_entities('guard_condition'))
            for source in sources:
                if _is_ready(source, wait_set, triggered):
                    source.announce()
            if self._sigint_guard.handle.pointer in triggered:
                self._signalled_until = monotonic() + _SIGNAL_SEC
                self._engine.wake()

    def _filled(self, sources: Iterable[PolledSource]) -> Any:
        """Return a wait set with the guard conditions and `sources` in it."""
        count: Any = NumberOfEntities(num_gcs=2)
        for source in sources:
            if isinstance(source, GuardConditionSource):
                count.num_guard_conditions += 1
            else:
                count += source.entity.get_num_entities()
        sizes = (
            count.num_subscriptions,
            count.num_guard_conditions,
            count.num_timers,
            count.num_clients,
            count.num_services,
            count.num_events,
        )
        if self._wait_set is None or self._wait_set[0] != sizes:
            context = self._desk.executor.context
            with context.handle:
                self._wait_set = (sizes, _rclpy.WaitSet(*sizes, context.handle))
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

    def _timeout(self, most_sec: float | None) -> float | None:
        now = monotonic()
        dues = [watch.due for watch in (self._given, self._default) if watch.sources]
        if most_sec is not None:
            dues.append(now + most_sec)
        if now < self._signalled_until:
            dues.append(now + _SIGNAL_POLL_SEC)
        return max(0.0, min(dues) - now) if dues else None

    def _sweep(self) -> None:
        now = monotonic()
        due = [w for w in (self._given, self._default) if w.sources and w.due <= now]
        if not due:
            return
        context = self._desk.executor.context
        with suppress(InvalidHandle):
            with context.handle:
                wait_set = _rclpy.WaitSet(0, 0, 0, 0, 0, 1, context.handle)
            for watch in due:
                watch.sweep(wait_set)


def _handle_of(source: PolledSource) -> Any:
    if isinstance(source, WaitableSource):
        return source.entity
    return source.entity.handle


def _is_ready(source: PolledSource, wait_set: Any, triggered: set[int]) -> bool:
    if isinstance(source, WaitableSource):
        return bool(source.entity.is_ready(wait_set))
    return source.entity.handle.pointer in triggered
