"""What sources are, and the plain ones: subscriptions, services and clients.

A source knows how to hear of news of an entity, take it and run the callback. Each does what
`rclpy.executors.Executor` does for its kind (`_take_subscription` and so on).
"""

import inspect
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle
from rclpy.qos import HistoryPolicy
from rclpy.subscription import Subscription

from composer.executor import c_bindings
from composer.executor.after_fork import end_child
from composer.executor.event_poller import UNKNOWN
from composer.executor.missed import Missed
from composer.executor.scheduler import Group, Schedule

if TYPE_CHECKING:
    from composer.executor.deadlines import Alarms
    from composer.executor.event_poller import Signal, SignalBoard

NOTHING = object()
"""What `Source.run` returns when there was nothing to take."""


class Desk:
    """What sources work with: the parts of one executor."""

    def __init__(
        self,
        executor: Any,
        schedule: Schedule,
        board: 'SignalBoard',
        alarms: 'Alarms',
    ) -> None:
        self.executor = executor
        self.schedule = schedule
        self.board = board
        self.alarms = alarms
        self.look_again: Callable[[Source], None] = _look_at_nothing
        self.peek: Callable[[], bool] = bool

    def has_more(self) -> bool:
        """Look for signals; returns whether there were any, or there are tasks to run."""
        return self.peek() or bool(self.schedule.count_runs())


def _look_at_nothing(_: 'Source') -> None:
    """Stand in until there is a lane."""


class Source:
    """An entity in an executor; subclasses know its kind.

    rclpy executes what is ready at the same time by its kind: timers, subscriptions, guard
    conditions, clients, services, waitables. That is what `rank` is for.
    """

    rank = 0
    __slots__ = (
        '__weakref__',
        '_asynchronous',
        '_callback',
        'alive',
        'desk',
        'entity',
        'group',
        'node',
        'pending',
        'queued',
        'signal',
        'slow',
        'stamp',
    )

    def __init__(self, entity: Any, node: Any, desk: Desk) -> None:
        self.entity = entity
        self.node = node
        self.desk = desk
        self.group: Group = desk.schedule.group_of(entity.callback_group)
        self.alive = True
        self.queued = False
        self.pending = 0
        self.stamp = 0
        self.slow = False
        self.signal: Signal | None = None
        self._callback: Any = None
        self._asynchronous = False

    def open(self, shared: 'Signal | None' = None) -> None:
        """Begin to listen."""
        raise NotImplementedError

    def close(self) -> None:
        """Listen no more."""
        raise NotImplementedError

    def run(self) -> Any:
        """Take and run the callback; returns its coroutine if it is one, or `NOTHING`."""
        raise NotImplementedError

    def on_signal(self, count: int) -> None:
        """Hear of news."""
        self.desk.schedule.announce(self, count)

    def missed(self) -> Missed:
        """Return what the entity has missed since it is listened to."""
        return Missed()

    def _is_async(self, callback: Any) -> bool:
        if callback is not self._callback:
            self._callback = callback
            self._asynchronous = inspect.iscoroutinefunction(callback)
        return self._asynchronous

    def _watch(self, watch: Callable[[int, int | None], None], shared: 'Signal | None') -> None:
        self.signal = self.desk.board.attach(self, shared)
        try:
            with self.entity.handle:
                watch(self.entity.handle.pointer, self.signal.fd)
        except BaseException:
            self.desk.board.detach(self, self.signal)
            raise
        self.desk.schedule.announce(self, UNKNOWN)

    def _unwatch(self, watch: Callable[[int, int | None], None]) -> None:
        self.alive = False
        with suppress(InvalidHandle, c_bindings.ExecutorError), self.entity.handle:
            watch(self.entity.handle.pointer, None)
        if self.signal is not None:
            self.desk.board.detach(self, self.signal)


class SubscriptionSource(Source):
    """A subscription.

    What the middleware announced and nobody can take has been pushed out of its queue by newer
    messages. `_taken` counts a take from before it begins until it finds nothing, so that one
    under way in another thread, as reentrant groups have them, is not held for a loss.
    """

    rank = 1
    __slots__ = ('_announced', '_overruns', '_taken')

    def open(self, shared: 'Signal | None' = None) -> None:
        """See the base class."""
        self._announced = 0
        self._taken = 0
        self._overruns = 0
        self._watch(c_bindings.watch_subscription, shared)

    def on_signal(self, count: int) -> None:
        """See the base class."""
        if count < UNKNOWN:
            self._announced += count
        super().on_signal(count)

    def missed(self) -> Missed:
        """See the base class."""
        profile = self.entity.qos_profile
        if profile.history == HistoryPolicy.KEEP_LAST and profile.depth:
            # A queue that never runs empty: the middleware holds no more than its depth.
            self._note_overruns(self._announced - self._taken - profile.depth)
        return Missed(overruns=self._overruns)

    def _note_overruns(self, count: int) -> None:
        # A message may be taken right before it is announced, and the count be too low for once.
        self._overruns = max(self._overruns, count)

    def close(self) -> None:
        """See the base class."""
        self._unwatch(c_bindings.watch_subscription)

    def run(self) -> Any:
        """See the base class."""
        entity = self.entity
        stamp = self.stamp
        announced = self._announced
        self._taken += 1
        handle = entity.handle
        try:
            with handle:
                taken = handle.take_message(entity.msg_type, entity.raw)
        except InvalidHandle:
            return NOTHING
        if taken is None:
            self._taken -= 1
            self._note_overruns(announced - self._taken)
            self.desk.schedule.drained(self, stamp)
            return NOTHING
        callback = entity.callback
        if entity._callback_type is Subscription.CallbackType.MessageOnly:  # noqa: SLF001
            result = callback(taken[0])
        else:
            result = callback(*taken)
        return result if result is not None and self._is_async(callback) else None


class ClientSource(Source):
    """A service client.

    Somebody who spins until the response is there stops then. So it lets go first what came
    with it or before it, once: rclpy executes tasks and messages before responses.
    """

    rank = 2
    __slots__ = ('_gave_way',)

    def open(self, shared: 'Signal | None' = None) -> None:
        """See the base class."""
        self._gave_way = False
        self._watch(c_bindings.watch_client, shared)

    def close(self) -> None:
        """See the base class."""
        self._unwatch(c_bindings.watch_client)

    def run(self) -> Any:
        """See the base class."""
        self._gave_way = not self._gave_way and self.desk.has_more()
        if self._gave_way:
            self.desk.schedule.announce(self, 1)
            return NOTHING
        stamp = self.stamp
        try:
            handle = self.entity.handle
            with handle:
                header, response = handle.take_response(self.entity.srv_type.Response)
        except InvalidHandle:
            return NOTHING
        if header is None:
            self.desk.schedule.drained(self, stamp)
            return NOTHING
        try:
            future = self.entity.get_pending_request(header.request_id.sequence_number)
        except KeyError:
            return NOTHING  # The request was given up.
        future._set_executor(self.desk.executor)  # noqa: SLF001
        future.set_result(response)
        return None


class ServiceSource(Source):
    """A service."""

    rank = 3
    __slots__ = ()

    def open(self, shared: 'Signal | None' = None) -> None:
        """See the base class."""
        self._watch(c_bindings.watch_service, shared)

    def close(self) -> None:
        """See the base class."""
        self._unwatch(c_bindings.watch_service)

    def run(self) -> Any:
        """See the base class."""
        stamp = self.stamp
        service = self.entity
        try:
            handle = service.handle
            with handle:
                request, header = handle.service_take_request(service.srv_type.Request)
        except InvalidHandle:
            return NOTHING
        if header is None:
            self.desk.schedule.drained(self, stamp)
            return NOTHING
        callback = service.callback
        response = callback(request, service.srv_type.Response())
        if self.desk.executor.is_inherited:
            end_child()
        if self._is_async(callback):
            return self._respond(response, header)
        service.send_response(response, header)
        return None

    async def _respond(self, response: Any, header: Any) -> None:
        self.entity.send_response(await response, header)
