"""Records the topics of a running system, or of the ROS graph alone.

Messages of a system's own publishers are recorded where they are published, whether they are
handed over or sent; so recording changes neither. What others publish comes through
subscriptions, which get the messages of own publishers, too, where these send; those are left out.
"""

from __future__ import annotations

from functools import partial
from time import time_ns
from typing import TYPE_CHECKING, Any, Final

from rclpy.serialization import serialize_message

from composer.recordings.graph_recorder import GraphRecorder, read_offer
from composer.recordings.recorder import Recorder
from composer.recordings.recording_place import find_place
from composer.recordings.serialized_messages import identify_publisher
from composer.recordings.topic_patterns import TopicPatterns
from composer.runtime.messages.local_delivery import is_latched
from composer.runtime.middleware.ros_graph import create_graph_node

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from rclpy.context import Context
    from rclpy.node import Node as RosNode
    from rclpy.subscription import Subscription as RosSubscription

    from composer.recordings.mcap_writer import Channel
    from composer.recordings.recorder import Log, Sink
    from composer.recordings.topic_patterns import Patterns
    from composer.runtime.messages.local_delivery import (
        LocalPublisher,
        LocalSubscription,
        LocalTopics,
        Tap,
    )

_NODE_NAME: Final = '_composer_recorder'


def create_recorder(target: Path, topics: Sequence[str], log: Log) -> SystemRecorder:
    """Return what writes a recording.

    Args:
        target: A file, or a folder as rosbag2 makes it.
        topics: Patterns of the topics; all if there are none.
        log: Gets what becomes of it.

    Raises:
        UsageError: The target exists, or its folder does not, or a pattern is empty.
        ComposerError: The file cannot be written, or the library for recordings is not installed.
    """
    patterns = TopicPatterns(topics)
    return SystemRecorder(Recorder(find_place(target), log), patterns, log.warning)


class SystemRecorder:
    """Records a system, or the ROS graph alone, from `start` to `stop`.

    Args:
        sink: Writes the file.
        patterns: Which topics.
        report: Gets what keeps a topic, or a message, from being recorded.
        node_name: Of the node that listens to others.
        is_late: Whether it may begin with a topic when messages have been latched.
    """

    def __init__(
        self,
        sink: Sink,
        patterns: Patterns,
        report: Callable[[str], object],
        node_name: str = _NODE_NAME,
        *,
        is_late: bool = False,
    ) -> None:
        self._node_name, self._is_late = node_name, is_late
        self.sink = sink
        self._patterns = patterns
        self._report = report
        self._topics: LocalTopics | None = None
        self._node: RosNode | None = None
        self._graph: GraphRecorder | None = None
        self._has_ended = False

    def start(self, context: Context, topics: LocalTopics | None = None) -> None:
        """Begin; the system has no nodes yet.

        Args:
            topics: Those of the system; `None` for the ROS graph alone.
        """
        own: _OwnPublishers | None = None
        if topics is not None:
            own = _OwnPublishers(topics, leaves_latched=self._is_late)
            self._topics = topics
            self._find = partial(self._find_tap, own)
            topics.tap(self._find)
        self._node = create_graph_node(context, self._node_name)
        self._graph = GraphRecorder(self._node, self.sink, self._patterns, self._report, own)
        self._graph.start()

    def follow(self, topic: str) -> None:
        """Begin anew with a topic, of which the patterns may say something else now."""
        if self._graph is not None:
            self._graph.forget(topic)
        if self._topics is not None:
            self._topics.follow_taps()

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
        self.sink.finish(self._patterns.describe_unused(seen))

    def _find_tap(self, own: _OwnPublishers, publisher: LocalPublisher) -> Tap | None:
        ros = publisher.ros
        topic = ros.topic_name
        if not self._patterns.has(topic) or (self._is_late and is_latched(ros)):
            return None
        own.publishers.add(identify_publisher(ros))
        offers = [read_offer(ros.qos_profile)]
        channel = self.sink.open_channel(topic, ros.msg_type, offers)
        return create_tap(self.sink, channel, self._report)


def create_tap(recorder: Sink, channel: Channel, report: Callable[[str], object]) -> Tap:
    """Return what records a message of a publisher, in the thread that publishes it."""
    queue = recorder.queue

    def tap(message: Any) -> None:
        if len(queue) >= recorder.room:
            recorder.lost += 1
            return
        try:
            data = serialize_message(message)
        except Exception as error:  # noqa: BLE001 - whoever publishes it is told by rclpy
            report(f"a message of '{channel.topic}' is left out: {error}")
            return
        now_ns = time_ns()
        queue.append((channel, now_ns, now_ns, data))

    return tap


class _OwnPublishers:
    """See `OwnPublishers`."""

    may_be_late = True

    def __init__(self, topics: LocalTopics, *, leaves_latched: bool) -> None:
        self._topics = topics
        self._leaves_latched = leaves_latched
        self.publishers: set[bytes] = set()
        self._listeners: dict[RosSubscription, LocalSubscription] = {}

    def count(self) -> Counter[str]:
        return self._topics.count_publishers(leaves_latched=self._leaves_latched)

    def has(self, publisher: bytes) -> bool:
        return publisher in self.publishers

    def adopt(self, node: RosNode, subscription: RosSubscription) -> None:
        self._listeners[subscription] = self._topics.add_listener(node, subscription)

    def drop(self, subscription: RosSubscription) -> None:
        self._topics.remove_subscription(self._listeners.pop(subscription))

    def release(self, node: RosNode) -> None:
        self._topics.forget(node)
