"""Which entities there are: the nodes' lists compared with what is listened to."""

import threading
from contextlib import suppress
from time import monotonic
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.exceptions import InvalidHandle

from composer.executor.entity_sources import TimerSource
from composer.executor.event_poller import Signal
from composer.executor.event_source import (
    ClientSource,
    Desk,
    ServiceSource,
    Source,
    SubscriptionSource,
)
from composer.executor.wait_set_thread import Lane
from composer.executor.waitable_sources import (
    ActionSource,
    GuardConditionSource,
    PolledSource,
    WaitableSource,
)

_SERVICES_PER_SIGNAL = 8
_REST_SHARE = 4


class _NodeEntities:
    """What was last seen of one node."""

    def __init__(self) -> None:
        self.lists: tuple[tuple[Any, ...], ...] = ()
        self.sources: dict[Any, Source] = {}


class Registry:
    """The sources of all nodes. Comparing 1,000 nodes takes some milliseconds, so it may wait."""

    def __init__(self, desk: Desk, lane: Lane) -> None:
        self._desk = desk
        self._lane = lane
        self._lock = threading.RLock()
        self._nodes: dict[Any, _NodeEntities] = {}
        self._rest_until = 0.0
        self.is_stale = False

    def rest_sec(self) -> float:
        """How long the next comparison should wait, so that comparing stays a small part."""
        return max(0.0, self._rest_until - monotonic())

    def refresh(self, nodes: list[Any]) -> None:
        """Listen to all entities of `nodes` and to nothing else."""
        with self._lock:
            self.is_stale = False
            begin = monotonic()
            changed = False
            for node in self._nodes.keys() - set(nodes):
                self.drop(node)
            for node in nodes:
                changed |= self._refresh_node(node)
            end = monotonic()
            self._rest_until = end + _REST_SHARE * (end - begin)
        if changed:
            self._lane.look_soon()

    def source_of(self, node: Any, entity: Any) -> Source | None:
        """Return the source of an entity of `node`, None if it is not listened to."""
        entities = self._nodes.get(node)
        return None if entities is None else entities.sources.get(entity)

    def leave_to_parent(self) -> None:
        """Have no sources; the parent listens to the entities."""
        self._nodes = {}

    def drop(self, node: Any) -> None:
        """Listen no more to the entities of `node`."""
        with self._lock:
            entities = self._nodes.pop(node, None)
            if entities is not None:
                for source in entities.sources.values():
                    self._close(source)

    def _refresh_node(self, node: Any) -> bool:
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
            return False
        seen.lists = lists
        kinds = (
            TimerSource,
            SubscriptionSource,
            GuardConditionSource,
            ClientSource,
            ServiceSource,
        )
        wanted: dict[Any, type[Source]] = {
            entity: kind
            for kind, entities in zip(kinds, lists, strict=False)
            for entity in entities
        }
        wanted.update((waitable, _waitable_kind(waitable)) for waitable in lists[-1])
        for entity in seen.sources.keys() - wanted.keys():
            self._close(seen.sources.pop(entity))
        shared: list[Signal] = []
        for entity, kind in wanted.items():
            if entity not in seen.sources:
                with suppress(InvalidHandle):
                    seen.sources[entity] = self._opened(kind(entity, node, self._desk), shared)
        return True

    def _opened(self, source: Source, shared: list[Signal]) -> Source:
        """Open `source`; up to eight services, which are called seldom, share a signal."""
        if isinstance(source, PolledSource):
            source.open()
            self._lane.add(source)
        elif not isinstance(source, ServiceSource):
            source.open()
        elif shared and len(shared[-1].listeners) < _SERVICES_PER_SIGNAL:
            source.open(shared[-1])
        else:
            source.open()
            if source.signal is not None:
                shared.append(source.signal)
        return source

    def _close(self, source: Source) -> None:
        if isinstance(source, PolledSource):
            self._lane.remove(source)
        source.close()


def _waitable_kind(waitable: Any) -> type[Source]:
    if isinstance(waitable, ActionServer | ActionClient):
        return ActionSource
    return WaitableSource
