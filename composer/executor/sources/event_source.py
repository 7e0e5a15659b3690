"""What all kinds of sources share: a source listens to one entity, takes what came and runs it."""

from __future__ import annotations

import inspect
import weakref
from typing import TYPE_CHECKING, Any, ClassVar

from rclpy.exceptions import InvalidHandle

from composer.executor.c_bindings import Readiness
from composer.executor.event_fds import UNKNOWN_COUNT, EventFd
from composer.executor.event_poller import EventPoller
from composer.executor.scheduler import Group, Scheduler
from composer.executor.sources.qos_events import QosEventPoll

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.executor.sources.inbox import Inbox

NOTHING = object()
"""What `EventSource.run` returns when there was nothing to take."""


class ExecutorParts:
    """The parts of an executor that its sources and its threads work with.

    Args:
        max_running: How many callbacks may run at the same time.
        poller: Where events arrive; a new one by default.
        scheduler: Creates the queues, as `Scheduler` does.

    Attributes:
        is_forked: Whether this process is a child that was forked after the executor was made.
    """

    def __init__(
        self,
        executor: Any,
        max_running: int,
        poller: EventPoller | None = None,
        scheduler: Callable[..., Scheduler] = Scheduler,
    ) -> None:
        self._executor = weakref.ref(executor)
        self.context = executor.context
        self.is_forked = False
        self.readiness = Readiness(executor.context)
        self.poller = poller or EventPoller()
        self.event_fds = self.poller.event_fds
        self.deadlines = self.poller.deadlines
        self.qos_event_poll = QosEventPoll(self.deadlines, self.readiness, self.event_fds.lock)
        self.scheduler = scheduler(
            max_running, self.poller.wake, self.poller.waiting_threads, self._has_node
        )

    @property
    def executor(self) -> Any:
        """The executor, which a thread that waits must not keep; None once it is gone."""
        return self._executor()

    def _has_node(self, node: Any) -> bool:
        return node in self.executor._nodes  # noqa: SLF001


class EventSource:
    """An entity in an executor; each subclass is for a kind of entity.

    A subclass does what `rclpy.executors.Executor` does for its kind (`_take_subscription` etc.).

    Attributes:
        rank: The order of what is ready at the same time. rclpy executes timers, subscriptions,
            guard conditions, clients, services, waitables.
        has_own_event_fd: Whether it has an eventfd of its own from the start, if there are any.
        ask: The method of `Readiness` that tells whether there is something to take.
        watch_entity: The function that has rcl write to an eventfd.
        observer: Is told what happens to the entity; or None.
        inbox: What comes to it without the middleware; or None.
        local, spends: See `scheduler.QueuedSource`.
        slow: Whether the last callback held up the leader.
    """

    rank = 0
    has_own_event_fd = True
    ask: ClassVar[Any] = None
    watch_entity: ClassVar[Any] = None
    __slots__ = (
        '__weakref__',
        '_callback',
        '_is_coroutine_function',
        'alive',
        'entity',
        'event_fd',
        'group',
        'inbox',
        'local',
        'node',
        'observer',
        'parts',
        'pending',
        'queued',
        'revision',
        'slow',
        'spends',
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
        self.observer: Any = None
        self.inbox: Inbox | None = None
        self.local: Any = ()
        self.spends = 1
        self._callback: Any = None
        self._is_coroutine_function = False

    def open(self) -> None:
        """Listen to the entity."""
        self.parts.event_fds.attach(self)
        self.parts.scheduler.add_events(self, UNKNOWN_COUNT)

    def close(self) -> None:
        """Stop listening."""
        self.alive = False
        if self.inbox is not None:
            self.inbox.source = None
        self.parts.event_fds.detach(self)

    def connect(self, inbox: Inbox) -> None:
        """Take what comes to `inbox`, too."""
        self.inbox, self.local, self.spends = inbox, inbox.messages, 0
        inbox.source = self
        self.parts.scheduler.add_events(self, UNKNOWN_COUNT)

    def watch(self, fd: int | None) -> None:
        """Have rcl add to the eventfd `fd` when something new is there; None for nowhere."""
        with self.entity.handle:
            self.watch_entity(self.entity.handle.pointer, fd)

    def is_gone(self) -> bool:
        """Tell whether rcl writes nowhere any more, because nothing is left of the entity."""
        return not self.entity.handle.pointer

    def run(self) -> Any:
        """Take and run the callback; returns its coroutine if it has one, or `NOTHING`."""
        raise NotImplementedError

    def on_events(self, count: int) -> None:
        """Queue the source, which has `count` more to take."""
        self.parts.scheduler.add_events(self, count)

    def _note_taken(self) -> None:
        """Have an eventfd of its own: it is busy."""
        event_fd = self.event_fd
        if event_fd is not None and event_fd.is_shared:
            self.parts.event_fds.note_busy(self)

    def _note_nothing_taken(self, revision: int) -> None:
        """Go on only if the middleware has something after all.

        A malformed request, or a response to another client, is taken as if there was nothing:
        what was announced may be behind it.
        """
        if self.pending and not self.has_data():
            self.parts.scheduler.set_empty(self, revision)

    def has_data(self) -> bool:
        """Ask the middleware whether there is something to take."""
        try:
            with self.entity.handle:
                has_data: bool = self.ask(self.parts.readiness, self.entity.handle.pointer)
                return has_data
        except InvalidHandle:
            return False

    def _is_async(self, callback: Any) -> bool:
        if callback is not self._callback:
            self._callback = callback
            self._is_coroutine_function = inspect.iscoroutinefunction(callback)
        return self._is_coroutine_function
