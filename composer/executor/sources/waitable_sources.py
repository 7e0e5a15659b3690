"""Actions, guard conditions and other waitables as event sources."""

import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from time import monotonic_ns
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.executor import c_bindings
from composer.executor.event_fds import UNKNOWN_COUNT
from composer.executor.sources.event_source import NOTHING, EventSource


class _ActionTimer:
    """A timer inside an action, by its address."""

    def __init__(self, pointer: int, source: 'ActionSource') -> None:
        self.deadline_ns: int | None = None
        self._pointer = pointer
        self._source = source

    def on_deadline(self) -> None:
        self._source.on_events(1)

    def rearm(self) -> None:
        deadlines = self._source.parts.deadlines
        try:
            with self._source.hold_entity():
                until_ns = c_bindings.time_until_next_call(self._pointer)
        except InvalidHandle:
            return
        if until_ns is None:
            deadlines.set(self, None)
        else:
            deadlines.set(self, monotonic_ns() + max(0, until_ns))


class ActionSource(EventSource):
    """An action server or client: a waitable made of services, clients, subscriptions, a timer.

    An event of any part leads to a check of all of them with a wait set of its own.
    """

    rank = 4
    __slots__ = ('_checking', '_clock', '_parts', '_timers', '_wait_set')

    def hold_entity(self) -> Any:
        """Return a context in which the entity is not destroyed."""
        handle = getattr(self.entity, '_handle', None)
        return self.entity._client_handle if handle is None else handle  # noqa: SLF001

    def open(self) -> None:
        """See the base class."""
        self._checking = threading.Lock()
        self._clock = None
        with self.hold_entity():
            self._wait_set = _create_wait_set_of(self.entity, self.parts.context)
            self._parts = c_bindings.list_parts(self._wait_set)
            self._timers = [
                _ActionTimer(pointer, self)
                for watch, pointer in self._parts
                if watch is c_bindings.watch_timer_reset
            ]
            self.parts.event_fds.attach(self)
        if self._timers:
            self._clock = self.parts.deadlines.follow(self.entity._node.get_clock(), self)  # noqa: SLF001
        self.on_events(1)

    def close(self) -> None:
        """See the base class."""
        for timer in self._timers:
            self.parts.deadlines.set(timer, None)
        if self._clock is not None:
            self.parts.deadlines.unfollow(self._clock, self)
        super().close()

    def watch(self, fd: int | None) -> None:
        """See the base class."""
        with self.hold_entity():
            for watch, pointer in self._parts:
                watch(pointer, fd)

    def is_gone(self) -> bool:
        """See the base class."""
        return not self.hold_entity().pointer

    def on_events(self, count: int) -> None:  # noqa: ARG002
        """See the base class."""
        self.parts.scheduler.add_events(self, UNKNOWN_COUNT)

    def rearm(self) -> None:
        """Check all parts, for the clock has jumped."""
        self.on_events(1)

    def run(self) -> Any:
        """See the base class."""
        if self.local:
            with suppress(IndexError):  # Another thread took it.
                return self._serve(self.local.popleft())
        revision = self.revision
        data = None
        try:
            with self._checking, self.hold_entity():
                ready = is_ready(self.entity, self._wait_set)
                if ready:
                    data = self.entity.take_data()
        except InvalidHandle:
            return NOTHING
        if not ready:
            for timer in self._timers:
                timer.rearm()
            self.parts.scheduler.set_empty(self, revision)
            return NOTHING
        self._note_taken()
        return self._execute(data)

    def _execute(self, data: Any) -> Any:
        return self._serve(lambda: _execute_waitable(self.entity, data, self.parts.executor))

    async def _serve(self, serve: Callable[[], Any]) -> None:
        with ExitStack() as stack:
            try:
                # rclpy uses it after the user's callbacks.
                stack.enter_context(self.hold_entity())
            except InvalidHandle:
                return
            await serve()


class WaitSetSource(EventSource):
    """An entity without event callbacks; the wait set thread or a poll queues it.

    The entity's `_executor_event` is True from then until it is taken, as in rclpy.

    Attributes:
        on_taken: Called when the entity can be waited for again, if it is waited for.
    """

    on_taken: Callable[[], None] | None
    __slots__ = ('on_taken',)

    def open(self) -> None:
        """See the base class; the wait set thread does the rest."""
        self.on_taken = None
        self.entity._executor_event = False  # noqa: SLF001

    def close(self) -> None:
        """See the base class."""
        self.alive = False

    def set_ready(self) -> None:
        """Queue the source, because its entity is ready."""
        self.entity._executor_event = True  # noqa: SLF001
        self.parts.scheduler.set_ready(self)

    def _forget_event(self) -> None:
        self.entity._executor_event = False  # noqa: SLF001
        if self.on_taken is not None:
            self.on_taken()


class GuardConditionSource(WaitSetSource):
    """A guard condition."""

    __slots__ = ()

    def close(self) -> None:
        """See the base class."""
        super().close()
        if self.entity._executor_event:  # noqa: SLF001
            with suppress(InvalidHandle):
                self.entity.trigger()  # For the next executor.

    def run(self) -> Any:
        """See the base class."""
        self._forget_event()
        callback = self.entity.callback
        result = callback()
        return result if result is not None and self._is_async(callback) else None


class WaitableSource(WaitSetSource):
    """A waitable of any kind, ready because its `is_ready` said so."""

    __slots__ = ()

    def run(self) -> Any:
        """See the base class."""
        try:
            data = self.entity.take_data()
        except InvalidHandle:
            return NOTHING
        finally:
            self._forget_event()
        return _execute_waitable(self.entity, data, self.parts.executor)


class QosEventSource(WaitableSource):
    """A QoS event for which the wait set thread waits."""

    __slots__ = ()


class SeldomQosEventSource(WaitableSource):
    """A QoS event that need not be handled at once; `QosEventPoll` queues it."""

    __slots__ = ('rmw_event',)

    def open(self) -> None:
        """See the base class."""
        super().open()
        with self.entity:
            wait_set = _create_wait_set_of(self.entity, self.parts.context)
            self.rmw_event = c_bindings.find_rmw_event(wait_set)
        self.parts.qos_event_poll.add(self)

    def close(self) -> None:
        """See the base class."""
        super().close()
        self.parts.qos_event_poll.remove(self)

    def set_ready(self) -> None:
        """See the base class."""
        self.entity.is_ready(_HasHappened())  # Otherwise it takes nothing.
        super().set_ready()


class _HasHappened:
    """A wait set as it looks to a QoS event that has happened."""

    def is_ready(self, _kind: str, _index: int) -> bool:
        return True


def create_wait_set(sizes: tuple[int, ...], context: Any) -> Any:
    """Return a wait set for so many entities of each kind, in the order of `sizes_of`."""
    with context.handle:
        return _rclpy.WaitSet(*sizes, context.handle)


def sizes_of(count: Any) -> tuple[int, ...]:
    """Return the sizes of a wait set for the entities that `count`, a NumberOfEntities, counts."""
    return (
        count.num_subscriptions,
        count.num_guard_conditions,
        count.num_timers,
        count.num_clients,
        count.num_services,
        count.num_events,
    )


def is_ready(waitable: Any, wait_set: Any) -> bool:
    """Ask the middleware and `waitable` itself whether it is ready now."""
    with wait_set:
        wait_set.clear_entities()
        waitable.add_to_wait_set(wait_set)
        wait_set.wait(0)
        return bool(waitable.is_ready(wait_set))


def _create_wait_set_of(waitable: Any, context: Any) -> Any:
    wait_set = create_wait_set(sizes_of(waitable.get_num_entities()), context)
    with wait_set:
        wait_set.clear_entities()
        waitable.add_to_wait_set(wait_set)
    return wait_set


def _execute_waitable(waitable: Any, data: Any, executor: Any) -> Any:
    """Return the coroutine that handles `data`."""
    for future in list(waitable._futures):  # noqa: SLF001
        future._set_executor(executor)  # noqa: SLF001
    return waitable.execute(data)
