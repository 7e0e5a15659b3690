"""Records the topics of a running system.

Messages of its own publishers are recorded where they are published, whether they are handed over
or sent; so recording changes neither. What others publish comes through subscriptions, which get
the messages of own publishers, too, where these send; those are left out there.
"""

from __future__ import annotations

from functools import partial
from time import time_ns
from typing import TYPE_CHECKING, Any, Final

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.recordings.graph_recorder import GraphRecorder, read_offer
from composer.recordings.serialized_messages import identify_publisher
from composer.runtime.middleware.ros_graph import create_graph_node

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.context import Context
    from rclpy.node import Node as RosNode
    from rclpy.subscription import Subscription as RosSubscription

    from composer.recordings.mcap_writer import Channel
    from composer.recordings.recorder import Recorder
    from composer.recordings.topic_patterns import TopicPatterns
    from composer.runtime.messages.local_delivery import LocalPublisher, LocalTopics

_NODE_NAME: Final = '_composer_recorder'


class SystemRecorder:
    """Records a system from `start` to `stop`.

    Args:
        recorder: Writes the file.
        patterns: Which topics.
        report: Gets what keeps a topic, or a message, from being recorded.
    """

    def __init__(
        self, recorder: Recorder, patterns: TopicPatterns, report: Callable[[str], object]
    ) -> None:
        self._recorder = recorder
        self._patterns = patterns
        self._report = report
        self._topics: LocalTopics | None = None
        self._node: RosNode | None = None
        self._graph: GraphRecorder | None = None
        self._has_ended = False

    def start(self, context: Context, topics: LocalTopics) -> None:
        """Begin; the system has no nodes yet.

        Args:
            topics: Those of the system.
        """
        own = _OwnPublishers(topics)
        self._topics = topics
        self._find = partial(self._find_tap, own)
        topics.tap(self._find)
        self._node = create_graph_node(context, _NODE_NAME)
        self._graph = GraphRecorder(self._node, self._recorder, self._patterns, self._report, own)
        self._graph.start()

    def stop(self) -> None:
        """Record what has come, and complete the file; do nothing the second time."""
        if self._has_ended:
            return
        self._has_ended = True
        if self._topics is not None:
            self._topics.untap(self._find)
        if self._graph is not None:
            self._graph.stop()
        if self._node is not None:
            self._node.destroy_node()
        seen = self._graph.topics if self._graph else ()
        self._recorder.finish(self._patterns.describe_unused(seen))

    def _find_tap(
        self, own: _OwnPublishers, publisher: LocalPublisher
    ) -> Callable[[Any], None] | None:
        ros = publisher.ros
        topic = ros.topic_name
        if not self._patterns.has(topic):
            return None
        own.publishers.add(identify_publisher(ros))
        offers = [read_offer(ros.qos_profile)]
        channel = self._recorder.open_channel(topic, ros.msg_type, offers)
        return create_tap(self._recorder, channel, ros.msg_type, self._report)


def create_tap(
    recorder: Recorder,
    channel: Channel,
    message_class: type,
    report: Callable[[str], object],
) -> Callable[[Any], None]:
    """Return what records a message of a publisher, in the thread that publishes it."""
    serialize, queue, append = _rclpy.rclpy_serialize, recorder.queue, recorder.queue.append

    def tap(message: Any) -> None:
        if len(queue) >= recorder.room:
            recorder.lost += 1
            return
        try:
            data = serialize(message, message_class)
        except Exception as error:  # noqa: BLE001 - whoever publishes it is told by rclpy
            report(f"a message of '{channel.topic}' is not recorded: {error}")
            return
        now_ns = time_ns()
        append((channel, now_ns, now_ns, data))

    return tap


class _OwnPublishers:
    """See `OwnPublishers`."""

    may_be_late = True

    def __init__(self, topics: LocalTopics) -> None:
        self._topics = topics
        self.publishers: set[bytes] = set()

    def count(self, topic: str) -> int:
        return self._topics.count_publishers(topic)

    def has(self, publisher: bytes) -> bool:
        return publisher in self.publishers

    def adopt(self, node: RosNode, subscription: RosSubscription) -> None:
        self._topics.add_listener(node, subscription)

    def release(self, node: RosNode) -> None:
        self._topics.forget(node)
