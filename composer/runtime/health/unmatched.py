"""Publishers and subscriptions that meet on a topic and cannot talk: told with both ends named.

That the QoS of two ends differs is an event of ROS, which does not tell the other end; the graph
does. That their types differ is no event of Fast DDS, and is seen in the graph alone.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    ReliabilityPolicy,
    qos_check_compatible,
)

from composer.language.specs import PublisherSpec
from composer.runtime.health.watcher import Watcher

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from rclpy.node import Node as RosNode
    from rclpy.qos import QoSProfile
    from rclpy.topic_endpoint_info import TopicEndpointInfo

    from composer.language.specs import SubscriptionSpec

_PAUSE_SEC = 1.0
# The graph may learn the name of an end a little later than the event tells of it.
_MOST_LOOKS = 10
_UNKNOWN_NAME = '_NODE_NAME_UNKNOWN_'

# What a publisher offers beside what a subscription wants, and cannot give.
_CONFLICTS = {
    'reliability': (ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE),
    'durability': (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL),
    'liveliness': (LivelinessPolicy.AUTOMATIC, LivelinessPolicy.MANUAL_BY_TOPIC),
}


class TopicEndpoint:
    """A publisher or subscription of a node, and whom it cannot talk to.

    Args:
        ros: Its node.
        place: Where the file declares it, as `file:line`.

    Attributes:
        topic: Its name in the graph.
    """

    def __init__(
        self,
        ros: RosNode,
        spec: PublisherSpec | SubscriptionSpec,
        profile: QoSProfile,
        place: str,
    ) -> None:
        self.ros = ros
        self._place = place
        self._spec = spec
        self._profile = profile
        self._publishes = isinstance(spec, PublisherSpec)
        self._told: set[tuple[str, str]] = set()
        self._looks = 0
        self.topic = ros.resolve_topic_name(spec.topic)

    def subscription_events(self) -> SubscriptionEventCallbacks:
        """Return what rclpy takes for a subscription."""
        return SubscriptionEventCallbacks(
            incompatible_qos=self._default_incompatible_qos, use_default_callbacks=False
        )

    def publisher_events(self) -> PublisherEventCallbacks:
        """Return what rclpy takes for a publisher."""
        return PublisherEventCallbacks(
            incompatible_qos=self._default_incompatible_qos, use_default_callbacks=False
        )

    @property
    def is_due(self) -> bool:
        """Whether there must be somebody who has not been found."""
        return self._looks > 0

    def look(self) -> None:
        """Find those whom it cannot talk to, and tell of each once."""
        found = False
        for end in self._others():
            name = f'{end.node_namespace.rstrip("/")}/{end.node_name}'
            reason = self._reason(end)
            if reason is None or end.node_name == _UNKNOWN_NAME:
                continue
            found = True
            if (name, reason) not in self._told:
                self._told.add((name, reason))
                self._tell(name, reason)
        self._looks = 0 if found else max(self._looks - 1, 0)

    def expect(self) -> None:
        """Look for somebody in the next moments, for there must be one."""
        self._looks = _MOST_LOOKS

    def _default_incompatible_qos(self, _event: Any) -> None:
        # The executor looks seldom at handlers of such a name, as at those of rclpy itself.
        self.expect()

    def _others(self) -> list[TopicEndpointInfo]:
        get = (
            self.ros.get_subscriptions_info_by_topic
            if self._publishes
            else self.ros.get_publishers_info_by_topic
        )
        return list(get(self.topic))

    def _tell(self, name: str, reason: str) -> None:
        kind, what = (
            ('publisher', 'sends nothing to')
            if self._publishes
            else ('subscription', 'gets nothing from')
        )
        owner = f"{kind} '{self._spec.name}' ({self._place})"
        self.ros.get_logger().warning(f"{owner} {what} '{name}': {reason}")

    def _reason(self, end: TopicEndpointInfo) -> str | None:
        """Return why nothing passes between this end and another, `None` if it does."""
        if end.topic_type != self._spec.type:
            return f'its type is {end.topic_type} there, and {self._spec.type} here'
        here, there = self._profile, end.qos_profile
        offered, wanted = (here, there) if self._publishes else (there, here)
        compatibility, text = qos_check_compatible(offered, wanted)
        if compatibility != QoSCompatibility.ERROR:
            return None
        for policy, conflict in _CONFLICTS.items():
            values = getattr(offered, policy), getattr(wanted, policy)
            if values == conflict:
                return self._describe(policy, *(value.name.lower() for value in values))
        return str(text).removeprefix('ERROR: ').rstrip(';')

    def _describe(self, policy: str, offered: str, wanted: str) -> str:
        if self._publishes:
            return (
                f'{policy} is {offered} here, and {wanted} is wanted there; '
                f"set 'qos: {{{policy}: {wanted}}}' here, or {offered} there"
            )
        return (
            f'{policy} is {offered} there, and {wanted} is wanted here; '
            f"set 'qos: {{{policy}: {offered}}}' here, or {wanted} there"
        )


class GraphWatcher(Watcher):
    """The thread that looks who meets.

    Args:
        endpoints: Returns the endpoints that there are now.
    """

    def __init__(self, endpoints: Callable[[], Iterable[TopicEndpoint]]) -> None:
        super().__init__('composer-graph', self._look_unless_destroyed, _PAUSE_SEC)
        self._endpoints = endpoints
        self._seen: list[tuple[str, list[str]]] = []

    def _look_unless_destroyed(self) -> None:
        # A node may be destroyed meanwhile.
        with suppress(InvalidHandle):
            self._look_at_graph()

    def _look_at_graph(self) -> None:
        endpoints = list(self._endpoints())
        mixed = self._newly_mixed_topics(endpoints)
        for end in endpoints:
            if self._ended.is_set():
                return
            if end.topic in mixed:
                end.expect()
            if end.is_due:
                end.look()

    def _newly_mixed_topics(self, endpoints: list[TopicEndpoint]) -> set[str]:
        """Return the topics with several types, if anything in the graph has changed."""
        if not endpoints:
            return set()
        topics = endpoints[0].ros.get_topic_names_and_types()
        if topics == self._seen:
            return set()
        self._seen = topics
        return {name for name, types in topics if len(types) > 1}
