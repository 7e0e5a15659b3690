"""What all kinds of sources share: a source listens to one entity, takes what came and runs it."""

import inspect
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

from rclpy.exceptions import InvalidHandle

from composer.executor.c_bindings import ExecutorError
from composer.executor.event_poller import UNKNOWN_COUNT, EventFd, EventPoller
from composer.executor.scheduler import Group, Scheduler

NOTHING = object()
"""What `EventSource.run` returns when there was nothing to take."""


@dataclass(frozen=True, slots=True)
class MissedCounts:
    """What an entity missed because callbacks took too long, since the executor listens to it.

    Attributes:
        overruns: Messages that the middleware dropped from the queue of a subscription, because
            newer ones came before they were taken. Not those lost on the way to the queue.
        late_ticks: Ticks of a timer that began late.
        skipped_ticks: Ticks that never began: rcl skips those whose time has passed.
    """

    overruns: int = 0
    late_ticks: int = 0
    skipped_ticks: int = 0

    def __add__(self, other: 'MissedCounts') -> 'MissedCounts':
        return MissedCounts(
            self.overruns + other.overruns,
            self.late_ticks + other.late_ticks,
            self.skipped_ticks + other.skipped_ticks,
        )

    def __sub__(self, other: 'MissedCounts') -> 'MissedCounts':
        return MissedCounts(
            self.overruns - other.overruns,
            self.late_ticks - other.late_ticks,
            self.skipped_ticks - other.skipped_ticks,
        )

    def __bool__(self) -> bool:
        return self != MissedCounts()


class ExecutorParts:
    """The parts of an executor that its sources and its threads work with."""

    def __init__(self, executor: Any, max_running: int) -> None:
        self.executor = executor
        self.poller = EventPoller()
        self.deadlines = self.poller.deadlines
        self.scheduler = Scheduler(max_running, self.poller.wake, self._has_node)

    def _has_node(self, node: Any) -> bool:
        return node in self.executor._nodes  # noqa: SLF001


class EventSource:
    """An entity in an executor; each subclass is for a kind of entity.

    A subclass does what `rclpy.executors.Executor` does for its kind (`_take_subscription` etc.).

    Attributes:
        rank: The order of what is ready at the same time. rclpy executes timers, subscriptions,
            guard conditions, clients, services, waitables.
        watch: The function that has rcl write to an eventfd; None if the subclass does not use it.
        slow: Whether the last callback held up the leader.
    """

    rank = 0
    watch: ClassVar[Any] = None
    __slots__ = (
        '__weakref__',
        '_callback',
        '_is_coroutine_function',
        'alive',
        'entity',
        'event_fd',
        'group',
        'node',
        'parts',
        'pending',
        'queued',
        'revision',
        'slow',
    )

    def __init__(self, entity: Any, node: Any, parts: ExecutorParts) -> None:
        self.entity = entity
        self.node = node
        self.parts = parts
        self.group: Group = parts.scheduler.group_of(entity.callback_group)
        self.alive = True
        self.queued = False
        self.pending = 0
        self.revision = 0
        self.slow = False
        self.event_fd: EventFd | None = None
        self._callback: Any = None
        self._is_coroutine_function = False

    def open(self, shared: EventFd | None = None) -> None:
        """Listen to the entity, with an eventfd of its own or `shared`."""
        self._listen(shared)
        self.parts.scheduler.add_events(self, UNKNOWN_COUNT)

    def close(self) -> None:
        """Stop listening."""
        self.alive = False
        with suppress(InvalidHandle, ExecutorError), self.entity.handle:
            self.watch(self.entity.handle.pointer, None)
        self._detach()

    def run(self) -> Any:
        """Take and run the callback; returns its coroutine if it has one, or `NOTHING`."""
        raise NotImplementedError

    def on_events(self, count: int) -> None:
        """Queue the source, which has `count` more to take."""
        self.parts.scheduler.add_events(self, count)

    def missed_counts(self) -> MissedCounts:
        """Return what the entity has missed."""
        return MissedCounts()

    def _is_async(self, callback: Any) -> bool:
        if callback is not self._callback:
            self._callback = callback
            self._is_coroutine_function = inspect.iscoroutinefunction(callback)
        return self._is_coroutine_function

    def _listen(self, shared: EventFd | None) -> None:
        self.event_fd = self.parts.poller.attach(self, shared)
        try:
            with self.entity.handle:
                self.watch(self.entity.handle.pointer, self.event_fd.fd)
        except BaseException:
            self.parts.poller.detach(self, self.event_fd)
            raise

    def _detach(self) -> None:
        if self.event_fd is not None:
            self.parts.poller.detach(self, self.event_fd)
