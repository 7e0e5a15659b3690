"""Records what is published on the ROS graph, through subscriptions of its own."""

from __future__ import annotations

import os
import select
import threading
from collections import Counter, deque
from contextlib import suppress
from time import monotonic, thread_time, time_ns
from typing import TYPE_CHECKING, Any, Final, Protocol

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from composer.errors import ComposerError
from composer.executor.c_bindings import watch_subscription
from composer.interfaces.classes import interface_name
from composer.recordings.definitions import import_message
from composer.recordings.metadata import INFINITE_NS
from composer.recordings.serialized_messages import MessageTaker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rclpy.node import Node as RosNode
    from rclpy.subscription import Subscription as RosSubscription
    from rclpy.topic_endpoint_info import TopicEndpointInfo

    from composer.recordings.mcap_writer import Channel
    from composer.recordings.recorder import Sink
    from composer.recordings.topic_patterns import Patterns

# A look at the graph takes at most a fiftieth of the time.
_SHORTEST_PAUSE_SEC: Final = 0.1
_LONGEST_PAUSE_SEC: Final = 1.0
_PAUSE_FACTOR: Final = 50
# As many messages of a topic may come while Python does something else.
_DEPTH: Final = 1000
_END_SEC: Final = 5.0


class OwnPublishers(Protocol):
    """The publishers whose messages are recorded where they are published.

    Attributes:
        may_be_late: Whether the graph may know one of them before these do.
    """

    may_be_late: bool

    def count(self) -> Counter[str]:
        """Return how many of them each topic has."""

    def has(self, publisher: bytes) -> bool:
        """Return whether a publisher is one of them; see `SerializedMessage`."""

    def adopt(self, node: RosNode, subscription: RosSubscription) -> None:
        """Note that a subscription needs nothing of them."""

    def drop(self, subscription: RosSubscription) -> None:
        """Forget a subscription."""

    def release(self, node: RosNode) -> None:
        """Forget the subscriptions of a node."""


class _NoPublishers:
    may_be_late = False

    def count(self) -> Counter[str]:
        return Counter()

    def has(self, publisher: bytes) -> bool:  # noqa: ARG002 - as in `OwnPublishers`
        return False

    def adopt(self, node: RosNode, subscription: RosSubscription) -> None:
        """There is nobody to tell."""

    def drop(self, subscription: RosSubscription) -> None:
        """There is nobody to tell."""

    def release(self, node: RosNode) -> None:
        """There is nobody to tell."""


class _Listener:
    """A subscription whose messages are recorded."""

    def __init__(self, ros: RosSubscription, channel: Channel, publishers: int) -> None:
        self.ros = ros
        self.channel = channel
        self.publishers = publishers
        self.event = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        with ros.handle:
            watch_subscription(ros.handle.pointer, self.event)

    def close(self) -> None:
        with suppress(InvalidHandle), self.ros.handle:
            watch_subscription(self.ros.handle.pointer, None)
        os.close(self.event)


class GraphRecorder:
    """Records topics of the ROS graph from `start` to `stop`, those that come later included.

    Args:
        node: Gets the subscriptions. Nobody spins it.
        patterns: Which topics.
        report: Gets what keeps a topic from being recorded.
        own: The publishers whose messages come another way.

    Attributes:
        topics: The names of all topics that were seen.
    """

    def __init__(
        self,
        node: RosNode,
        recorder: Sink,
        patterns: Patterns,
        report: Callable[[str], object],
        own: OwnPublishers | None = None,
    ) -> None:
        self._node = node
        self._recorder = recorder
        self._patterns = patterns
        self._report = report
        self._own = own or _NoPublishers()
        self.topics: set[str] = set()
        self._listeners: dict[int, _Listener] = {}
        self._forgotten: deque[str] = deque()
        self._heard: set[tuple[str, str]] = set()
        # What seemed to have publishers of others at the last look.
        self._suspected: set[str] = set()
        self._taker = MessageTaker()
        self._poll = select.poll()
        self._ended = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._poll.register(self._ended, select.POLLIN)
        self._thread = threading.Thread(target=self._run, name='composer-listener', daemon=True)

    def start(self) -> None:
        """Subscribe to the topics that there are, and begin to look for others."""
        self._look()
        self._thread.start()

    def forget(self, topic: str) -> None:
        """Listen to a topic no more, or anew if it is still meant; any thread may call it."""
        self._forgotten.append(topic)

    def _drop_forgotten(self) -> None:
        forgotten = {self._forgotten.popleft() for _ in range(len(self._forgotten))}
        for event, listener in list(self._listeners.items()):
            if listener.channel.topic in forgotten:
                self._poll.unregister(event)
                del self._listeners[event]
                listener.close()
                self._own.drop(listener.ros)
                self._node.destroy_subscription(listener.ros)
        self._heard = {each for each in self._heard if each[0] not in forgotten}

    def stop(self) -> None:
        """Record what has come, and end the subscriptions."""
        os.eventfd_write(self._ended, 1)
        if self._thread.ident is not None:
            self._thread.join(_END_SEC)
        for listener in self._listeners.values():
            self._take_all(listener)
            listener.close()
        self._own.release(self._node)
        self._listeners.clear()
        self._taker.close()

    def _run(self) -> None:
        next_look = monotonic()
        while True:
            left_sec = max(0.0, next_look - monotonic())
            for event, _ in self._poll.poll(1000 * left_sec + 1):
                if event == self._ended:
                    return
                with suppress(BlockingIOError):
                    os.eventfd_read(event)
                self._take_all(self._listeners[event])
            if monotonic() >= next_look:
                next_look = monotonic() + _LONGEST_PAUSE_SEC
                # A behaviour may have shut down what all use; the system ends then.
                with suppress(InvalidHandle, _rclpy.RCLError):
                    next_look = monotonic() + self._look()

    def _look(self) -> float:
        """Subscribe to the topics that have come; return when to look again, in seconds."""
        begun = thread_time()
        self._drop_forgotten()
        own = self._own.count()
        found = list(self._find_new(own))
        self._tell_unmatched(own)
        pause_sec = _PAUSE_FACTOR * (thread_time() - begun)
        for topic, type_name in found:
            self._subscribe(topic, type_name)
        return min(max(pause_sec, _SHORTEST_PAUSE_SEC), _LONGEST_PAUSE_SEC)

    def _find_new(self, own: Counter[str]) -> Iterator[tuple[str, str]]:
        """Yield the topics and types that others publish, and nobody listens to here."""
        for topic, types in self._node.get_topic_names_and_types():
            self.topics.add(topic)
            if not self._patterns.has(topic):
                continue
            new = [each for each in types if (topic, each) not in self._heard]
            if not new or self._node.count_publishers(topic) <= own[topic]:
                self._suspected.discard(topic)
            elif self._own.may_be_late and topic not in self._suspected:
                self._suspected.add(topic)
            else:
                yield from ((topic, each) for each in new)

    def _tell_unmatched(self, own: Counter[str]) -> None:
        """Tell of publishers that have come since, and offer less than is asked for."""
        for listener in self._listeners.values():
            topic, before = listener.channel.topic, listener.publishers
            if self._node.count_publishers(topic) - own[topic] <= before:
                continue
            ends = self._find_publishers(topic, interface_name(listener.ros.msg_type))
            listener.publishers = max(before, len(ends))
            asked = match_offers(read_offer(each.qos_profile) for each in ends)
            profile = listener.ros.qos_profile
            if (asked.reliability, asked.durability) != (profile.reliability, profile.durability):
                self._report(
                    f"'{topic}' may be recorded in part: publishers that came later offer other "
                    'reliability or durability than those before'
                )

    def _find_publishers(self, topic: str, type_name: str) -> list[TopicEndpointInfo]:
        """Return the publishers of others."""
        return [
            each
            for each in self._node.get_publishers_info_by_topic(topic)
            if each.topic_type == type_name and not self._own.has(bytes(each.endpoint_gid))
        ]

    def _subscribe(self, topic: str, type_name: str) -> None:
        ends = self._find_publishers(topic, type_name)
        if not ends:
            return
        self._heard.add((topic, type_name))
        try:
            message_class = import_message(type_name)
        except ComposerError as error:
            self._report(f"'{topic}' is not recorded: {error}")
            return
        offers = [read_offer(each.qos_profile) for each in ends]
        channel = self._recorder.open_channel(topic, message_class, offers)
        profile = match_offers(offers)
        ros = self._node.create_subscription(
            message_class, topic, lambda _message: None, profile, raw=True
        )
        self._own.adopt(self._node, ros)
        listener = _Listener(ros, channel, len(ends))
        self._listeners[listener.event] = listener
        self._poll.register(listener.event, select.POLLIN)
        # Some may have come before it was watched.
        self._take_all(listener)

    def _take_all(self, listener: _Listener) -> None:
        recorder, own = self._recorder, self._own
        while (message := self._taker.take(listener.ros)) is not None:
            if own.has(message.publisher):
                continue
            if len(recorder.queue) >= recorder.room:
                recorder.lost += 1
                continue
            received_ns = message.received_ns or time_ns()
            published_ns = message.published_ns or received_ns
            recorder.queue.append((listener.channel, received_ns, published_ns, message.data))


def read_offer(profile: QoSProfile) -> dict[str, Any]:
    """Return the QoS of a publisher as a recording has it; see `metadata.write_qos`."""
    words = ('history', 'reliability', 'durability', 'liveliness')
    policies: dict[str, Any] = {name: getattr(profile, name).name.lower() for name in words}
    policies['depth'] = profile.depth
    for name in ('deadline', 'lifespan', 'liveliness_lease_duration'):
        duration_ns = getattr(profile, name).nanoseconds
        # 0 is no limit either, but readers know only the other form.
        policies[name] = duration_ns or INFINITE_NS
    return policies


def match_offers(offers: Iterable[dict[str, Any]]) -> QoSProfile:
    """Return what matches all publishers, and asks for as much as all offer, as rosbag2 does.

    Source: `Rosbag2QoS::adapt_request_to_offers` in rosbag2_storage (`src/qos.cpp`).
    """
    offers = list(offers)
    all_reliable = all(each['reliability'] == 'reliable' for each in offers)
    all_kept = all(each['durability'] == 'transient_local' for each in offers)
    durability = DurabilityPolicy.TRANSIENT_LOCAL if all_kept else DurabilityPolicy.VOLATILE
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if all_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=durability,
        liveliness=LivelinessPolicy.AUTOMATIC,
    )
