"""Actions, guard conditions and other waitables as sources."""

import threading
from contextlib import ExitStack, suppress
from time import monotonic_ns
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.executor import c_bindings
from composer.executor.event_poller import UNKNOWN
from composer.executor.event_source import NOTHING, Source

if TYPE_CHECKING:
    from composer.executor.deadlines import ClockWatch
    from composer.executor.event_poller import Signal


class _WaitablePart:
    """A timer inside a waitable, by its address."""

    def __init__(self, pointer: int, source: 'ActionSource') -> None:
        self.deadline_ns: int | None = None
        self._pointer = pointer
        self._source = source

    def on_deadline(self) -> None:
        self._source.on_signal(1)

    def rearm(self) -> None:
        desk = self._source.desk
        try:
            with self._source.held():
                until_ns = c_bindings.time_until_next_call(self._pointer)
        except InvalidHandle:
            return
        if until_ns is None:
            desk.alarms.set(self, None)
        else:
            desk.alarms.set(self, monotonic_ns() + max(0, until_ns))


class ActionSource(Source):
    """An action server or client: a waitable made of services, clients, subscriptions, a timer.

    Any of its parts announcing something leads to a look with a wait set of its own.
    """

    rank = 4
    __slots__ = ('_looking', '_parts', '_timers', '_wait_set', '_watched_clock')

    def held(self) -> Any:
        """Return a context in which the entity is not destroyed."""
        handle = getattr(self.entity, '_handle', None)
        return self.entity._client_handle if handle is None else handle  # noqa: SLF001

    def open(self, shared: 'Signal | None' = None) -> None:
        """See the base class."""
        self._looking = threading.Lock()
        self._timers: list[_WaitablePart] = []
        self._watched_clock: ClockWatch | None = None
        with self.held():
            self._wait_set = wait_set_for(self.entity, self.desk.executor.context)
            self._parts = c_bindings.parts_of(self._wait_set)
            self.signal = self.desk.board.attach(self, shared)
            for watch, pointer in self._parts:
                watch(pointer, self.signal.fd)
                if watch is c_bindings.watch_timer_reset:
                    self._timers.append(_WaitablePart(pointer, self))
        if self._timers:
            self._watched_clock = self.desk.alarms.follow(self.entity._node.get_clock(), self)  # noqa: SLF001
        self.on_signal(1)

    def close(self) -> None:
        """See the base class."""
        self.alive = False
        for timer in self._timers:
            self.desk.alarms.set(timer, None)
        if self._watched_clock is not None:
            self.desk.alarms.unfollow(self._watched_clock, self)
        with suppress(InvalidHandle, c_bindings.ExecutorError), self.held():
            for watch, pointer in self._parts:
                watch(pointer, None)
        if self.signal is not None:
            self.desk.board.detach(self, self.signal)

    def on_signal(self, count: int) -> None:  # noqa: ARG002
        """See the base class."""
        self.desk.schedule.announce(self, UNKNOWN)

    def rearm(self) -> None:
        """Look again, for the clock has jumped."""
        self.on_signal(1)

    def run(self) -> Any:
        """See the base class."""
        stamp = self.stamp
        data = None
        try:
            with self._looking, self.held():
                ready = look(self.entity, self._wait_set)
                if ready:
                    data = self.entity.take_data()
        except InvalidHandle:
            return NOTHING
        if not ready:
            for timer in self._timers:
                timer.rearm()
            self.desk.schedule.drained(self, stamp)
            return NOTHING
        return self._execute(data)

    async def _execute(self, data: Any) -> None:
        with ExitStack() as stack:
            try:
                stack.enter_context(self.held())  # rclpy uses it after the user's callbacks.
            except InvalidHandle:
                return
            await execute_waitable(self.entity, data, self.desk.executor)


class PolledSource(Source):
    """What only a wait set can see; the lane watches it and announces it.

    The entity's `_executor_event` is True from the announcement until it is taken, as in rclpy.
    """

    __slots__ = ()

    def open(self, shared: 'Signal | None' = None) -> None:  # noqa: ARG002
        """Nothing is pending yet; the lane does the rest."""
        self.entity._executor_event = False  # noqa: SLF001

    def close(self) -> None:
        """See the base class."""
        self.alive = False

    def announce(self) -> None:
        """Be ready."""
        self.entity._executor_event = True  # noqa: SLF001
        self.desk.schedule.announce_once(self)

    def _forget_event(self) -> None:
        self.entity._executor_event = False  # noqa: SLF001
        self.desk.look_again(self)


class GuardConditionSource(PolledSource):
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


class WaitableSource(PolledSource):
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
        return execute_waitable(self.entity, data, self.desk.executor)


def wait_set_for(waitable: Any, context: Any) -> Any:
    """Return a wait set of the right size to which `waitable` has added itself."""
    count = waitable.get_num_entities()
    with context.handle:
        wait_set = _rclpy.WaitSet(
            count.num_subscriptions,
            count.num_guard_conditions,
            count.num_timers,
            count.num_clients,
            count.num_services,
            count.num_events,
            context.handle,
        )
    with wait_set:
        wait_set.clear_entities()
        waitable.add_to_wait_set(wait_set)
    return wait_set


def look(waitable: Any, wait_set: Any) -> bool:
    """Ask the middleware and `waitable` itself whether it is ready now."""
    with wait_set:
        wait_set.clear_entities()
        waitable.add_to_wait_set(wait_set)
        wait_set.wait(0)
        return bool(waitable.is_ready(wait_set))


def execute_waitable(waitable: Any, data: Any, executor: Any) -> Any:
    """Return the coroutine that handles `data`."""
    for future in list(waitable._futures):  # noqa: SLF001
        future._set_executor(executor)  # noqa: SLF001
    return waitable.execute(data)
