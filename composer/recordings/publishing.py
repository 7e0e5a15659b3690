"""Publishes the messages of a recording to the ROS graph, as they were recorded."""

from __future__ import annotations

from time import monotonic, monotonic_ns, sleep
from typing import TYPE_CHECKING, Any, Final

from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from composer.recordings.recorded_topics import RecordingError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rclpy.node import Node as RosNode
    from rclpy.publisher import Publisher as RosPublisher

    from composer.recordings.reading import Recording
    from composer.recordings.recorded_topics import RecordedTopic
    from composer.recordings.types import MessageTypes

_NANOSECONDS: Final = 10**9
_POLL_SEC: Final = 0.05
# The graph is complete when nothing was new for so long.
_SETTLED_SEC: Final = 1.0
_LONGEST_SEARCH_SEC: Final = 5.0
_ACKNOWLEDGED: Final = Duration(seconds=2)
_LEAST_DEPTH: Final = 10
_MOST_DEPTH: Final = 100_000
# `sleep` takes no year.
_LONGEST_SLEEP_SEC: Final = 3600.0
# Longer durations are no limit.
_LONGEST_NS: Final = 2**62
_COMPARED: Final = ('deadline', 'liveliness', 'liveliness_lease_duration')


class RecordingPublisher:
    """Has a publisher for each topic of a recording.

    Args:
        topics: What to publish; those with a problem are left out.

    Attributes:
        topics: The names of what it publishes.
    """

    def __init__(
        self, node: RosNode, topics: Sequence[RecordedTopic], types: MessageTypes
    ) -> None:
        self._node = node
        self._publishers: dict[tuple[str, str], RosPublisher] = {}
        for topic in topics:
            message_class = types.find(topic)
            if message_class is not None:
                self._publishers[topic.name, topic.type] = node.create_publisher(
                    message_class, topic.name, adapt_offer(topic.qos)
                )
        self.topics = sorted({name for name, _ in self._publishers})

    def wait_for_subscriptions(self, *, of_all: bool) -> None:
        """Wait until those that are on the graph are found, as far as that can be known.

        Args:
            of_all: Whether to wait until each topic has one, for as long as that takes.
        """
        begun = settled = monotonic()
        shape: Any = None
        counts: list[int] = []
        while monotonic() < min(settled + _SETTLED_SEC, begun + _LONGEST_SEARCH_SEC) or (
            of_all and not all(counts)
        ):
            counts = [each.get_subscription_count() for each in self._publishers.values()]
            latest = counts, sorted(self._node.get_node_names_and_namespaces())
            if latest != shape:
                shape, settled = latest, monotonic()
            sleep(_POLL_SEC)

    def publish(self, recording: Recording, since_ns: int, rate: float) -> int:
        """Publish the messages at their times from now on; return how many there were.

        Args:
            since_ns: The time of the recording that is now.
            rate: How many times as fast as they were recorded.

        Raises:
            RecordingError: The recording cannot be read on, or a message is not of its type.
        """
        begun_ns, count = monotonic_ns(), 0
        for message in recording.raw_messages(self.topics, since_ns=since_ns):
            publisher = self._publishers.get((message.topic.name, message.topic.type))
            if publisher is None:
                continue
            due_ns = begun_ns + (message.time_ns - since_ns) / rate
            while (left_ns := due_ns - monotonic_ns()) > 0:
                sleep(min(left_ns / _NANOSECONDS, _LONGEST_SLEEP_SEC))
            try:
                publisher.publish(message.data)
            except _rclpy.RCLError as error:
                text = f"a recorded message of '{message.topic.name}' is no {message.topic.type}"
                raise RecordingError(text) from error
            count += 1
        return count

    def finish(self) -> None:
        """Wait until subscriptions have what was published, if they are reliable."""
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(_ACKNOWLEDGED)


def adapt_offer(offers: Sequence[Mapping[str, Any]]) -> QoSProfile:
    """Return the QoS of one publisher in place of those that were recorded.

    All that the subscriptions of each of them have asked for is offered. Where the recorded ones
    differ in what is not simply more or less, that is left at its default.
    """
    if not offers:
        return QoSProfile(depth=_LEAST_DEPTH)
    is_reliable = any(each['reliability'] != 'best_effort' for each in offers)
    is_kept = any(each['durability'] == 'transient_local' for each in offers)
    is_all_kept = any(each['history'] == 'keep_all' for each in offers)
    first, *others = offers
    same = [name for name in _COMPARED if all(each[name] == first[name] for each in others)]
    durations: dict[str, Any] = {
        name: Duration(nanoseconds=first[name])
        for name in ('deadline', 'liveliness_lease_duration')
        if name in same and 0 < first[name] < _LONGEST_NS
    }
    lifespan_ns = max(each['lifespan'] for each in offers)
    if 0 < lifespan_ns < _LONGEST_NS:
        durations['lifespan'] = Duration(nanoseconds=lifespan_ns)
    liveliness = LivelinessPolicy.SYSTEM_DEFAULT
    if 'liveliness' in same and first['liveliness'] == 'manual_by_topic':
        liveliness = LivelinessPolicy.MANUAL_BY_TOPIC
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if is_all_kept else HistoryPolicy.KEEP_LAST,
        depth=min(max(_LEAST_DEPTH, sum(each['depth'] for each in offers)), _MOST_DEPTH),
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_kept else DurabilityPolicy.VOLATILE,
        liveliness=liveliness,
        **durations,
    )
