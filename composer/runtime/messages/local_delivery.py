"""Messages between nodes of the system are handed over, where that is as good as to send them.

A publisher hands a message over while all that match it are subscriptions of the system. As soon
as somebody else listens, it sends, to everyone: the middleware cannot tell one subscription from
another. It hands over again when all that it has sent was taken; so messages of one publisher
never overtake each other.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSCompatibility,
    qos_check_compatible,
)

from composer.runtime.messages.ownership import ownership_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.publisher import Publisher as RosPublisher
    from rclpy.qos import QoSProfile
    from rclpy.subscription import Subscription as RosSubscription

    from composer.executor import ComposerExecutor
    from composer.executor.sources.inbox import Inbox

# Longer durations are no limit.
_LONGEST_NS = 2**62


class LocalPublisher:
    """A publisher of the system.

    Attributes:
        reason: Why its messages are sent; empty if they are handed over while nobody else listens.
    """

    def __init__(self, ros: RosPublisher, reason: str) -> None:
        self.ros = ros
        self.own_reason = self.reason = reason
        self.inboxes: tuple[Inbox, ...] | None = None
        self._ownership = ownership_of(ros.msg_type)
        self._count: Callable[[], int] = ros.handle.get_subscription_count
        self._send = ros.publish
        self._has_sent = False

    def publish(self, message: Any, *, is_held: bool) -> None:
        """Hand a message over, or send it.

        Args:
            is_held: Whether somebody refers to it.
        """
        inboxes = self.inboxes
        if inboxes is None or self._count() != len(inboxes):
            self._has_sent = True
            self._send(message)
            return
        if self._has_sent:
            if not all(inbox.is_drained() for inbox in inboxes):
                self._send(message)
                return
            self._has_sent = False
        if not inboxes:
            return
        ownership = self._ownership
        message = ownership.take(message, is_held=is_held)
        for inbox in inboxes[1:]:
            inbox.put(ownership.copy(message))
        inboxes[0].put(message)


class LocalSubscription:
    """A subscription of the system.

    Attributes:
        read_only: Whether it shares messages with others.
    """

    def __init__(
        self, ros: RosSubscription, inbox: Inbox, reason: str, *, read_only: bool
    ) -> None:
        self.ros = ros
        self.inbox = inbox
        self.reason = reason
        self.read_only = read_only


class _Topic:
    def __init__(self) -> None:
        self.publishers: list[LocalPublisher] = []
        self.subscriptions: list[LocalSubscription] = []

    def connect(self) -> None:
        """Find out to which subscriptions each publisher hands over."""
        for publisher in self.publishers:
            matched = [
                each
                for each in self.subscriptions
                if _are_compatible(publisher.ros.qos_profile, each.ros.qos_profile)
            ]
            reasons = [publisher.own_reason, *(each.reason for each in matched)]
            publisher.reason = next(filter(None, reasons), '')
            publisher.inboxes = None if publisher.reason else tuple(each.inbox for each in matched)


class LocalTopics:
    """The topics of one system, by their names in the graph and their types."""

    def __init__(self, executor: ComposerExecutor) -> None:
        self._executor = executor
        self._topics: defaultdict[tuple[str, type], _Topic] = defaultdict(_Topic)
        self._lock = threading.Lock()

    def add_publisher(self, ros: RosPublisher, *, is_local: bool = True) -> LocalPublisher:
        """Take in a publisher."""
        publisher = LocalPublisher(ros, _own_reason(ros, is_local=is_local))
        self._change(ros, lambda topic: topic.publishers.append(publisher))
        return publisher

    def change_publisher(self, publisher: LocalPublisher, *, is_local: bool) -> None:
        """Let a publisher hand messages over, or only send them."""

        def change(_: _Topic) -> None:
            publisher.own_reason = _own_reason(publisher.ros, is_local=is_local)

        self._change(publisher.ros, change)

    def add_subscription(
        self, node: Any, ros: RosSubscription, *, read_only: bool = False
    ) -> LocalSubscription:
        """Take in a subscription of `node`."""
        inbox = self._executor.open_inbox(node, ros, queue_depth(ros.qos_profile))
        reason = _why_sent(ros.qos_profile)
        subscription = LocalSubscription(ros, inbox, reason, read_only=read_only)
        self._change(ros, lambda topic: topic.subscriptions.append(subscription))
        return subscription

    def change_subscription(self, subscription: LocalSubscription, *, read_only: bool) -> None:
        """Let a subscription share messages with others, or have its own."""

        def change(_: _Topic) -> None:
            subscription.read_only = read_only

        self._change(subscription.ros, change)

    def remove_publisher(self, publisher: LocalPublisher) -> None:
        """Forget a publisher."""
        self._change(publisher.ros, lambda topic: topic.publishers.remove(publisher))

    def remove_subscription(self, subscription: LocalSubscription) -> None:
        """Forget a subscription."""
        self._change(subscription.ros, lambda topic: topic.subscriptions.remove(subscription))

    def _change(
        self, ros: RosPublisher | RosSubscription, change: Callable[[_Topic], None]
    ) -> None:
        with self._lock:
            topic = self._topics[ros.topic_name, ros.msg_type]
            change(topic)
            topic.connect()


def queue_depth(profile: QoSProfile) -> int | None:
    """Return how many messages a queue holds; `None` for any number."""
    depth: int = profile.depth
    return depth if profile.history == HistoryPolicy.KEEP_LAST else None


def _are_compatible(offered: QoSProfile, requested: QoSProfile) -> bool:
    compatibility, _ = qos_check_compatible(offered, requested)
    return bool(compatibility != QoSCompatibility.ERROR)


def _own_reason(ros: RosPublisher, *, is_local: bool) -> str:
    return _why_sent(ros.qos_profile) if is_local else 'local_delivery: false'


def _why_sent(profile: QoSProfile) -> str:
    """Return which policy the middleware must keep, if there is one."""
    if profile.durability != DurabilityPolicy.VOLATILE:
        return f'durability: {profile.durability.name.lower()}'
    if profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC:
        return 'liveliness: manual_by_topic'
    if profile.history == HistoryPolicy.KEEP_ALL:
        return 'history: keep_all'
    for name in ('deadline', 'lifespan'):
        if 0 < getattr(profile, name).nanoseconds < _LONGEST_NS:
            return name
    return ''
