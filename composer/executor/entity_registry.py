"""Which entities the executor listens to: compares the nodes' lists with its sources."""

import threading
from contextlib import suppress
from time import monotonic
from typing import Any, TypeGuard
from weakref import WeakKeyDictionary

from rclpy.event_handler import EventHandler
from rclpy.exceptions import InvalidHandle

from composer.executor.event_fds import UNKNOWN_COUNT
from composer.executor.sources.action_classes import (
    is_action_client,
    is_action_server,
    is_half_made,
)
from composer.executor.sources.entity_sources import (
    ClientSource,
    ServiceSource,
    SubscriptionSource,
    TimerSource,
)
from composer.executor.sources.event_source import EventSource, ExecutorParts
from composer.executor.sources.inbox import Inbox
from composer.executor.sources.qos_events import is_checked_seldom
from composer.executor.sources.waitable_sources import (
    ActionSource,
    GuardConditionSource,
    QosEventSource,
    SeldomQosEventSource,
    WaitableSource,
    WaitSetSource,
)
from composer.executor.wait_set_thread import WaitSetThread

_REST_FACTOR = 4


class _NodeEntities:
    """What a node had when it was last compared."""

    def __init__(self) -> None:
        self.lists: tuple[tuple[Any, ...], ...] = ()
        self.sources: dict[Any, EventSource] = {}


class EntityRegistry:
    """The sources of all nodes.

    Attributes:
        is_stale: Whether entities may have come or gone since the last `refresh`.
    """

    def __init__(self, parts: ExecutorParts, wait_set_thread: WaitSetThread) -> None:
        self._parts = parts
        self._wait_set_thread = wait_set_thread
        self._lock = threading.RLock()
        self._nodes: dict[Any, _NodeEntities] = {}
        self._observers: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()
        self._inboxes: WeakKeyDictionary[Any, Inbox] = WeakKeyDictionary()
        self._rest_until = 0.0
        self.is_stale = False

    def rest_sec(self) -> float:
        """Return how long the next `refresh` should wait, to use a small share of the time.

        To compare 1,000 nodes takes some milliseconds.
        """
        return max(0.0, self._rest_until - monotonic())

    def refresh_if_stale(self) -> None:
        """`refresh` if entities may have come or gone."""
        if self.is_stale:
            self.refresh()

    def flush(self) -> None:
        """Return when what only the wait set thread sees is queued, if it was triggered before."""
        self._wait_set_thread.flush_if_used()

    def rest(self) -> None:
        """Have the wait set thread see that nobody spins any more, if that is so."""
        self._wait_set_thread.wake()

    def refresh(self) -> None:
        """Listen to all entities of the executor's nodes, and to nothing else."""
        with self._lock:
            # Before the nodes are listed: one that is added meanwhile makes it stale again.
            self.is_stale = False
            nodes = self._parts.executor.get_nodes()
            begin = monotonic()
            for node in self._nodes.keys() - set(nodes):
                self.drop(node)
            try:
                for node in nodes:
                    self._refresh_node(node)
            except BaseException:
                self.is_stale = True  # Whoever spins on tries again.
                raise
            end = monotonic()
            self._rest_until = end + _REST_FACTOR * (end - begin)

    def observe(self, node: Any, entity: Any, observer: Any) -> None:
        """Have `observer` told what happens to an entity of `node`."""
        with self._lock:
            self._observers[entity] = observer
            entities = self._nodes.get(node)
            source = None if entities is None else entities.sources.get(entity)
            if source is not None:
                source.observer = observer
                source.on_events(UNKNOWN_COUNT)

    def open_inbox(self, node: Any, entity: Any, depth: int | None) -> Inbox:
        """Return a new inbox of a subscription or a service of `node`."""
        with self._lock:
            inbox = self._inboxes[entity] = Inbox(depth)
            entities = self._nodes.get(node)
            source = None if entities is None else entities.sources.get(entity)
            if source is not None:
                source.connect(inbox)
            return inbox

    def drop_all(self) -> None:
        """Stop listening to everything."""
        with self._lock:
            for node in tuple(self._nodes):
                with suppress(InvalidHandle):
                    self.drop(node)

    def drop(self, node: Any) -> None:
        """Stop listening to the entities of `node`."""
        with self._lock:
            entities = self._nodes.pop(node, None)
            if entities is not None:
                for source in entities.sources.values():
                    self._close(source)

    def _refresh_node(self, node: Any) -> None:
        seen = self._nodes.setdefault(node, _NodeEntities())
        lists = (
            tuple(node.timers),
            tuple(node.subscriptions),
            tuple(node.guards),
            tuple(node.clients),
            tuple(node.services),
            tuple(node.waitables),
        )
        if lists == seen.lists:
            return
        classes = (
            TimerSource,
            SubscriptionSource,
            GuardConditionSource,
            ClientSource,
            ServiceSource,
        )
        wanted: dict[Any, type[EventSource]] = {
            entity: source_class
            for source_class, entities in zip(classes, lists, strict=False)
            for entity in entities
        }
        half_made = set(filter(is_half_made, lists[-1]))
        wanted.update((each, _class_for(each)) for each in lists[-1] if each not in half_made)
        for entity in seen.sources.keys() - wanted.keys():
            self._close(seen.sources.pop(entity))
        for entity, source_class in wanted.items():
            if entity not in seen.sources:
                with suppress(InvalidHandle):
                    source = source_class(entity, node, self._parts)
                    source.observer = self._observers.get(entity)
                    if entity in self._inboxes:
                        source.connect(self._inboxes[entity])
                    self._open(source)
                    seen.sources[entity] = source
        if half_made:
            self.is_stale = True
        else:
            seen.lists = lists

    def _open(self, source: EventSource) -> None:
        source.open()
        if _is_waited_for(source):
            self._wait_set_thread.add(source)

    def _close(self, source: EventSource) -> None:
        if _is_waited_for(source):
            self._wait_set_thread.remove(source)
        source.close()


def _class_for(waitable: Any) -> type[EventSource]:
    if is_action_server(waitable) or is_action_client(waitable):
        return ActionSource
    if type(waitable) is EventHandler:
        is_seldom = is_checked_seldom(waitable.callback)
        return SeldomQosEventSource if is_seldom else QosEventSource
    return WaitableSource


def _is_waited_for(source: EventSource) -> TypeGuard[WaitSetSource]:
    return isinstance(source, WaitSetSource) and not isinstance(source, SeldomQosEventSource)
