"""Reports publishers and subscriptions of one topic that can never match, with both ends named.

Incompatible QoS is an event of ROS; the graph tells which end it is about. Fast DDS has no event
for incompatible types, which only the graph shows. Missed deadlines and lost liveliness are logged
once, then counted.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle

from composer.entity_kinds import KIND_OF_NOUN
from composer.executor import checked_seldom
from composer.language.qos_conflicts import CONFLICTS, describe_conflicts, find_qos_conflicts
from composer.runtime.health.watcher import Watcher
from composer.runtime.messages.qos_profiles import read_policies

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rclpy.node import Node as RosNode
    from rclpy.qos import QoSProfile
    from rclpy.topic_endpoint_info import TopicEndpointInfo

    from composer.language.specs import TopicEndSpec

_OnEvent: TypeAlias = 'Callable[[Any], None]'
_PAUSE_SEC = 1.0
# The graph may learn the name of an end some time after the event.
_MOST_CHECKS = 10
# Policies of these values are another one when the end has been created.
_LEFT_TO_THE_MIDDLEWARE = ('best_available', 'system_default')
_UNKNOWN_NAME = '_NODE_NAME_UNKNOWN_'
# At most one line about the same loss in this time.
_QUIET_SEC = 10.0


class TopicEndpoint:
    """A publisher or subscription of a node, which reports other ends that cannot match it.

    Args:
        ros: Its node.
        noun: Its kind, as in `publisher`.
        place: Returns where the file declares it, as `file:line`.

    Attributes:
        topic: Its name in the graph.
        losses: What it misses of what its QoS promises.
    """

    def __init__(
        self,
        ros: RosNode,
        noun: str,
        spec: TopicEndSpec,
        profile: QoSProfile,
        place: Callable[[], str],
    ) -> None:
        self.ros = ros
        self._spec = spec
        self._declared = read_policies(profile)
        self._noun = noun
        self._place = place
        self._publishes = KIND_OF_NOUN[noun].provides
        self._reported: set[tuple[str, str]] = set()
        self._checks_left = 0
        self.topic = ros.resolve_topic_name(spec.topic)
        self.losses = QosLosses(
            self.describe,
            self._declared,
            ros.get_logger().warning,
            publishes=self._publishes,
        )

    def describe(self) -> str:
        """Return its kind, name and place."""
        return f"{self._noun} '{self._spec.name}' ({self._place()})"

    def subscription_events(self, told: Mapping[str, _OnEvent]) -> SubscriptionEventCallbacks:
        """Return the event callbacks of a subscription.

        Args:
            told: What else takes events, by rclpy's names of these.
        """
        return SubscriptionEventCallbacks(use_default_callbacks=False, **self._callbacks(told))

    def publisher_events(self, told: Mapping[str, _OnEvent]) -> PublisherEventCallbacks:
        """Return the event callbacks of a publisher; see `subscription_events`."""
        return PublisherEventCallbacks(use_default_callbacks=False, **self._callbacks(told))

    def _callbacks(self, told: Mapping[str, _OnEvent]) -> dict[str, _OnEvent]:
        own: dict[str, _OnEvent] = {
            'incompatible_qos': self._on_incompatible_qos,
            **self.losses.callbacks(),
        }
        both = {name: _one_after_the_other(own.get(name), each) for name, each in told.items()}
        return {**own, **both}

    @property
    def is_due(self) -> bool:
        """Whether an end that cannot match was announced and has not been found."""
        return self._checks_left > 0

    def check(self) -> None:
        """Find the ends that cannot match, and report each once."""
        found = False
        policies = self._find_policies()
        for end in self._ends(publish=not self._publishes):
            name = f'{end.node_namespace.rstrip("/")}/{end.node_name}'
            reason = find_mismatch(end, self._spec.type, policies, publishes=self._publishes)
            if reason is None or end.node_name == _UNKNOWN_NAME:
                continue
            found = True
            if (name, reason) not in self._reported:
                self._reported.add((name, reason))
                self._report(name, reason)
        self._checks_left = 0 if found else max(self._checks_left - 1, 0)

    def expect(self) -> None:
        """Check a few times: there must be an end that cannot match."""
        self._checks_left = _MOST_CHECKS

    @checked_seldom
    def _on_incompatible_qos(self, _event: Any) -> None:
        self.expect()

    def _ends(self, *, publish: bool) -> list[TopicEndpointInfo]:
        """Return the publishers or the subscriptions of the topic."""
        get = (
            self.ros.get_publishers_info_by_topic
            if publish
            else self.ros.get_subscriptions_info_by_topic
        )
        return list(get(self.topic))

    def _find_policies(self) -> dict[str, Any]:
        """Return its own policies, those that the middleware has chosen included."""
        chosen = {
            policy for policy in CONFLICTS if self._declared[policy] in _LEFT_TO_THE_MIDDLEWARE
        }
        if chosen:
            own = self.ros.get_name(), self.ros.get_namespace()
            for end in self._ends(publish=self._publishes):
                policies = read_policies(end.qos_profile)
                if (end.node_name, end.node_namespace) == own and all(
                    policies[policy] == self._declared[policy]
                    for policy in CONFLICTS.keys() - chosen
                ):
                    return policies
        return self._declared

    def _report(self, name: str, reason: str) -> None:
        what = 'sends nothing to' if self._publishes else 'gets nothing from'
        text = f"{self.describe()} {what} '{name}': {reason}"
        self.ros.get_logger().warning(text)


def find_mismatch(
    end: TopicEndpointInfo, type_here: str, here: Mapping[str, Any], *, publishes: bool
) -> str | None:
    """Return why an end cannot match one here, `None` if it can.

    Args:
        type_here: The type of the message here.
        here: The policies here, as `read_policies` returns them.
        publishes: Whether the end here does.
    """
    if end.topic_type != type_here:
        return f'its type is {end.topic_type} there, and {type_here} here'
    there = read_policies(end.qos_profile)
    offered, requested = (here, there) if publishes else (there, here)
    conflicts = list(find_qos_conflicts(offered, requested))
    return describe_conflicts(conflicts, from_publisher=publishes) if conflicts else None


def _one_after_the_other(first: _OnEvent | None, second: _OnEvent) -> _OnEvent:
    if first is None:
        return second

    def call(event: Any) -> None:
        first(event)
        second(event)

    return call


class GraphObserver(Protocol):
    """Something that looks at the graph once a second."""

    def check(self, node: RosNode) -> None:
        """Look at it through a node."""


class GraphWatcher(Watcher):
    """The thread that checks endpoints when the graph shows a reason to.

    Args:
        endpoints: Returns the present endpoints.
        find_node: Returns a node that can ask the graph; `None` if there is none now.
        observers: What else looks at the graph each time.
    """

    def __init__(
        self,
        endpoints: Callable[[], Iterable[TopicEndpoint]],
        find_node: Callable[[], RosNode | None],
        observers: Iterable[GraphObserver],
    ) -> None:
        super().__init__('composer-graph', self._check_unless_destroyed, _PAUSE_SEC)
        self._endpoints = endpoints
        self._find_node = find_node
        self._observers = tuple(observers)
        self._seen: list[tuple[str, list[str]]] = []

    def _check_unless_destroyed(self) -> None:
        # A node may be destroyed meanwhile.
        with suppress(InvalidHandle):
            self._check_graph()
            node = self._find_node()
            for each in self._observers if node else ():
                each.check(node)

    def _check_graph(self) -> None:
        endpoints = list(self._endpoints())
        mixed = self._newly_mixed_topics(endpoints)
        for end in endpoints:
            if self._ended.is_set():
                return
            if end.topic in mixed:
                end.expect()
            if end.is_due:
                end.check()
            end.losses.flush_old()

    def _newly_mixed_topics(self, endpoints: list[TopicEndpoint]) -> set[str]:
        """Return the topics with several types, if anything in the graph has changed."""
        if not endpoints:
            return set()
        topics = endpoints[0].ros.get_topic_names_and_types()
        if topics == self._seen:
            return set()
        self._seen = topics
        return {name for name, types in topics if len(types) > 1}


@dataclass(slots=True)
class _LossCount:
    last_line: float = float('-inf')
    unreported: int = 0


class QosLosses:
    """What one publisher or subscription has missed of what its QoS promises.

    Args:
        describe: Returns what it is called in the log.
        policies: Its policies, where durations without a limit are left out.
        publishes: Whether it is a publisher.
        log: Takes the text, as the node's logger does.
    """

    def __init__(
        self,
        describe: Callable[[], str],
        policies: Mapping[str, Any],
        log: Callable[[str], Any],
        *,
        publishes: bool,
    ) -> None:
        self._describe = describe
        self._policies = policies
        self._publishes = publishes
        self._log = log
        self._counts: dict[str, _LossCount] = {}
        self._lock = threading.Lock()

    def callbacks(self) -> dict[str, Callable[[Any], None]]:
        """Return the callbacks of the QoS events that can occur, by rclpy's names of them."""
        callbacks: dict[str, Callable[[Any], None]] = {}
        if 'deadline' in self._policies:
            callbacks['deadline'] = self._on_missed_deadline
        if 'liveliness_lease_duration' in self._policies:
            callbacks['liveliness'] = (
                self._on_lost_liveliness if self._publishes else self._on_changed_liveliness
            )
        return callbacks

    def flush(self, before: float = float('inf')) -> None:
        """Log the counts of what was last logged before a time of `time.monotonic`."""
        with self._lock:
            due = {
                what: count
                for what, count in self._counts.items()
                if count.unreported and count.last_line <= before
            }
            lines = [self._format_count(what, count) for what, count in due.items()]
        for line in lines:
            self._log(line)

    def flush_old(self) -> None:
        """Log the counts of what was last logged long enough ago."""
        if self._counts:
            self.flush(monotonic() - _QUIET_SEC)

    @checked_seldom
    def _on_missed_deadline(self, event: Any) -> None:
        verb = 'published nothing' if self._publishes else 'got no message'
        deadline_sec = self._policies['deadline']
        self._report(f'{verb} within its deadline of {deadline_sec:g} s', event.total_count_change)

    @checked_seldom
    def _on_lost_liveliness(self, event: Any) -> None:
        lease_sec = self._policies['liveliness_lease_duration']
        what = f'lost its liveliness: it published nothing within its lease of {lease_sec:g} s'
        self._report(what, event.total_count_change)

    def _on_changed_liveliness(self, event: Any) -> None:
        # At once: of one that was lost and is back, the change is 0.
        lease_sec = self._policies['liveliness_lease_duration']
        what = f'lost a publisher: no sign of life within the lease of {lease_sec:g} s'
        self._report(what, event.not_alive_count_change)

    def _report(self, what: str, times: int) -> None:
        if times <= 0:
            # A publisher that is alive again, or that has ended.
            return
        with self._lock:
            count = self._counts.setdefault(what, _LossCount())
            is_first = count.last_line == float('-inf')
            if is_first:
                count.last_line = monotonic()
            count.unreported += times - is_first
        if is_first:
            self._log(f'{self._describe()} {what}')

    def _format_count(self, what: str, count: _LossCount) -> str:
        """Return the line about what was counted, and reset the count."""
        times = 'once more' if count.unreported == 1 else f'{count.unreported} more times'
        count.unreported = 0
        count.last_line = monotonic()
        return f'{self._describe()} {what}, {times}'
