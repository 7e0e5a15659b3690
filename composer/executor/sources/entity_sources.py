"""Timers, subscriptions, services and clients as event sources."""

import inspect
import threading
from time import monotonic_ns, time_ns
from typing import Any, Protocol

import rclpy.exceptions
import rclpy.timer
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.subscription import Subscription

from composer.executor import c_bindings
from composer.executor.after_fork import end_child
from composer.executor.c_bindings import Readiness
from composer.executor.event_fds import UNKNOWN_COUNT
from composer.executor.sources.event_source import NOTHING, EventSource

_MIN_RESET_NS = 1_000_000
_MOST_KNOWN = 1 << 32

# Since rclpy 9.
_TimerInfo = getattr(rclpy.timer, 'TimerInfo', None)
_TimerCancelledError = getattr(rclpy.exceptions, 'TimerCancelledError', InvalidHandle)


class TickObserver(Protocol):
    """Is told of the ticks of a timer."""

    def on_tick(self, late_ns: int, next_ns: int, period_ns: int) -> None:
        """Note a tick that began `late_ns` after its time; the next is `next_ns` after its."""


class QueueObserver(Protocol):
    """Is told what comes to a subscription, and what is taken.

    Attributes:
        timings: Of how many messages it is to be told how long they were on their way.
    """

    timings: int

    def on_announced(self, count: int | None) -> None:
        """Note that `count` messages came; None: nobody knows how many."""

    def begin_take(self) -> int:
        """Note that a take begins, and return what `note_nothing_taken` is to be told."""

    def note_nothing_taken(self, begun: int) -> None:
        """Note that nothing was there."""

    def note_delivery(self, duration_ns: int) -> None:
        """Note how long a message was on its way, from its publisher to the callback."""


class LocalRequest(Protocol):
    """A request that comes to a service without the middleware.

    Attributes:
        message: The request.
    """

    message: Any

    def respond(self, response: Any) -> None:
        """Take the response."""

    def fail(self, error: BaseException) -> None:
        """Take what the callback raised: there is no response."""


class TimerSource(EventSource):
    """A timer: due at its deadline, or when its ROS clock gets there; its events are resets."""

    has_own_event_fd = False
    watch_entity = staticmethod(c_bindings.watch_timer_reset)
    __slots__ = ('_clock', '_info_name', '_rearming', 'deadline_ns')

    def open(self) -> None:
        """See the base class."""
        self._rearming = threading.Lock()
        self.deadline_ns: int | None = None
        self._clock = None
        self.parts.event_fds.attach(self)
        self._clock = self.parts.deadlines.follow(self.entity.clock, self)
        self.rearm()

    def close(self) -> None:
        """See the base class."""
        self.parts.deadlines.set(self, None)
        if self._clock is not None:
            self.parts.deadlines.unfollow(self._clock, self)
        super().close()

    def on_events(self, count: int) -> None:  # noqa: ARG002
        """Find out when the timer is due, for it may have been reset."""
        before_ns = self.deadline_ns
        self.rearm()
        if before_ns != self.deadline_ns and (
            before_ns is None
            or self.deadline_ns is None
            or abs(self.deadline_ns - before_ns) > _MIN_RESET_NS
        ):
            self._note_taken()

    def on_deadline(self) -> None:
        """Queue the source; `run` asks rcl whether the timer is due."""
        self.parts.scheduler.set_ready(self)

    def rearm(self) -> None:
        """Find out when the timer is due next."""
        with self._rearming:
            self._rearm()

    def _rearm(self) -> None:
        try:
            handle = self.entity.handle
            with handle:
                until_ns = handle.time_until_next_call()
        except InvalidHandle:
            return
        clock = self._clock
        if until_ns is None or not self.alive:
            self.parts.deadlines.set(self, None)
        elif until_ns <= 0:
            self.parts.scheduler.set_ready(self)
        elif clock is not None and clock.clock.ros_time_is_active:
            self.parts.deadlines.set(self, None)
        else:
            self.parts.deadlines.set(self, monotonic_ns() + until_ns)

    def run(self) -> Any:
        """See the base class."""
        timer = self.entity
        callback = timer.callback
        if callback is not self._callback:
            self._info_name = _name_of_timer_info(callback)
        is_async = self._is_async(callback)
        try:
            handle = timer.handle
            with handle:
                arguments = self._call(handle)
        except (InvalidHandle, _TimerCancelledError):
            return NOTHING
        self.rearm()
        if arguments is None:
            return NOTHING
        result = callback(**arguments)
        return result if result is not None and is_async else None

    def _call(self, handle: Any) -> dict[str, Any] | None:
        """Tell rcl and the observer that the tick begins.

        Returns:
            The arguments of the callback, or None if the timer is not due.
        """
        begin_ns = monotonic_ns()
        until_ns = handle.time_until_next_call()
        if until_ns is None or until_ns > 0:
            return None
        arguments = {}
        if self._info_name is None:
            handle.call_timer()
        else:
            info = handle.call_timer_with_info()
            clock_type = self.entity.clock.clock_type
            arguments[self._info_name] = _TimerInfo(**info, clock_type=clock_type)  # type: ignore[misc]
        if self.observer is not None:
            next_until_ns = handle.time_until_next_call()
            period_ns = handle.get_timer_period()
            if next_until_ns is not None and period_ns:
                next_ns = next_until_ns - until_ns + monotonic_ns() - begin_ns
                self.observer.on_tick(-until_ns, next_ns, period_ns)
        return arguments


def _name_of_timer_info(callback: Any) -> str | None:
    """Return the parameter of `callback` that is annotated with `TimerInfo`, as rclpy finds it."""
    if _TimerInfo is None:
        return None
    try:
        parameters = inspect.signature(callback).parameters.values()
    except ValueError:  # A function in C may have none that is known.
        return None
    return next((p.name for p in parameters if p.annotation == _TimerInfo), None)


class SubscriptionSource(EventSource):
    """A subscription."""

    rank = 1
    ask = staticmethod(Readiness.has_messages)
    watch_entity = staticmethod(c_bindings.watch_subscription)
    __slots__ = ('_handle',)

    def open(self) -> None:
        """See the base class."""
        self._handle = self.entity.handle
        super().open()

    def on_events(self, count: int) -> None:
        """See the base class."""
        if self.observer is not None:
            event_fd = self.event_fd
            is_unknown = count >= UNKNOWN_COUNT or event_fd is None or event_fd.is_shared
            self.observer.on_announced(None if is_unknown else count)
        self.parts.scheduler.add_events(self, count)

    def run(self) -> Any:
        """See the base class."""
        local = self.local
        if local:
            if self.pending:
                self._limit_local()
            callback = self.entity.callback
            try:
                # In no variable: the callback may pass it on.
                taken = [local.popleft()]
            except IndexError:
                return NOTHING  # Another thread took it.
            if self.inbox is not None and self.inbox.put_ns:
                self._note_local_delivery(self.inbox.put_ns.pop(id(taken[0]), None))
            result = callback(taken.pop())
            return result if result is not None and self._is_async(callback) else None
        return self._run_taken()

    def _note_local_delivery(self, put_ns: int | None) -> None:
        if self.observer is not None and put_ns is not None:
            self.observer.note_delivery(monotonic_ns() - put_ns)

    def _limit_local(self) -> None:
        """Push out what one queue would not hold beside what the middleware has."""
        revision, pending = self.revision, self.pending
        if not self.has_data():
            self.parts.scheduler.set_empty(self, revision)
        elif self.inbox is not None:
            event_fd = self.event_fd
            is_known = pending < _MOST_KNOWN and event_fd is not None and not event_fd.is_shared
            self.inbox.limit_beside(pending if is_known else 1)

    def _run_taken(self) -> Any:
        entity = self.entity
        revision = self.revision
        observer = self.observer
        arrived = None if observer is None else observer.begin_take()
        if not self.spends:
            self.parts.scheduler.spend(self)
        try:
            # As nothing can be destroyed while C++ has the GIL, the handle need not be held.
            taken = self._handle.take_message(entity.msg_type, entity.raw)
        except _rclpy.RCLError:
            if self.is_gone():
                return NOTHING
            raise
        if taken is None:
            if observer is not None:
                observer.note_nothing_taken(arrived)
            self._note_nothing_taken(revision)
            return NOTHING
        if observer is not None and observer.timings:
            observer.timings -= 1
            observer.note_delivery(max(0, time_ns() - taken[1]['source_timestamp']))
        event_fd = self.event_fd
        if event_fd is not None and event_fd.is_shared:
            self._note_taken()  # Without the check, each message would cost a call.
        callback = entity.callback
        if entity._callback_type is Subscription.CallbackType.MessageOnly:  # noqa: SLF001
            result = callback(taken[0])
        else:
            result = callback(*taken)
        return result if result is not None and self._is_async(callback) else None


class ClientSource(EventSource):
    """A service client.

    Whoever spins until the response is there stops then. So what came with it or before it runs
    first, once for each response: rclpy executes tasks and messages before responses.
    """

    rank = 2
    ask = staticmethod(Readiness.has_responses)
    watch_entity = staticmethod(c_bindings.watch_client)
    __slots__ = ('_yielded_at',)

    def open(self) -> None:
        """See the base class."""
        self._yielded_at = -1
        super().open()

    def run(self) -> Any:
        """See the base class."""
        parts = self.parts
        # A run in vain may have yielded: that does not count for what comes after it. What came
        # before may be queued behind this by now: another thread may have looked.
        if self.revision != self._yielded_at and (
            parts.poller.peek() or not parts.scheduler.is_empty()
        ):
            self._yielded_at = self.revision + 1
            parts.scheduler.add_events(self, 1)
            return NOTHING
        revision = self.revision
        try:
            handle = self.entity.handle
            with handle:
                header, response = handle.take_response(self.entity.srv_type.Response)
        except InvalidHandle:
            return NOTHING
        if header is None:
            self._note_nothing_taken(revision)
            return NOTHING
        self._note_taken()
        try:
            future = self.entity.get_pending_request(header.request_id.sequence_number)
        except KeyError:
            return NOTHING  # The request was given up.
        future._set_executor(parts.executor)  # noqa: SLF001
        future.set_result(response)
        return None


class ServiceSource(EventSource):
    """A service."""

    has_own_event_fd = False
    rank = 3
    ask = staticmethod(Readiness.has_requests)
    watch_entity = staticmethod(c_bindings.watch_service)
    __slots__ = ('_serves_sent',)

    def open(self) -> None:
        """See the base class."""
        self._serves_sent = False
        super().open()

    def run(self) -> Any:
        """See the base class."""
        if self.local:
            # In turn, if others have sent requests, too.
            self._serves_sent = not self._serves_sent and self.pending > 0
            if not self._serves_sent:
                return self._serve_local()
        revision = self.revision
        if not self.spends:
            self.parts.scheduler.spend(self)
        service = self.entity
        try:
            handle = service.handle
            with handle:
                request, header = handle.service_take_request(service.srv_type.Request)
        except InvalidHandle:
            return NOTHING
        if header is None:
            self._note_nothing_taken(revision)
            return NOTHING
        self._note_taken()
        callback = service.callback
        try:
            response = callback(request, service.srv_type.Response())
        except BaseException as error:
            self.parts.executor.note_unanswered(service, header, error)
            raise
        if self.parts.is_forked:
            end_child()
        if self._is_async(callback):
            return self._respond(response, header)
        service.send_response(response, header)
        return None

    def _serve_local(self) -> Any:
        service = self.entity
        try:
            request: LocalRequest = self.local.popleft()
        except IndexError:
            return NOTHING  # Another thread took it, or it was pushed out.
        callback = service.callback
        if self._is_async(callback):
            return self._respond_locally(callback, request)
        try:
            # The response is in no variable: what nobody refers to need not be copied.
            request.respond(self._answer(callback, request.message))
        except BaseException as error:
            request.fail(error)
            raise
        return None

    def _answer(self, callback: Any, message: Any) -> Any:
        response = callback(message, self.entity.srv_type.Response())
        if self.parts.is_forked:
            end_child()
        return response

    async def _respond_locally(self, callback: Any, request: LocalRequest) -> None:
        try:
            request.respond(await self._answer(callback, request.message))
        except BaseException as error:
            request.fail(error)
            raise

    async def _respond(self, response: Any, header: Any) -> None:
        try:
            response = await response
        except BaseException as error:
            self.parts.executor.note_unanswered(self.entity, header, error)
            raise
        self.entity.send_response(response, header)
