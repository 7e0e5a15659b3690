"""Messages between nodes of the system are handed over, where that is as good as to send them.

A publisher hands a message over while all that match it are subscriptions of the system. As soon
as somebody else listens, it sends, to everyone: the middleware cannot tell one subscription from
another. It hands over again when all that it has sent was taken; so messages of one publisher
never overtake each other.

That is exact where the middleware delivers within `publish`, as Fast DDS does in one process. If
it may be told otherwise (see `may_be_late`), a publisher that has sent once does so for good.
"""

from __future__ import annotations

import os
import threading
from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile
from rclpy.utilities import get_rmw_implementation_identifier

from composer.runtime.messages.delivery_policies import (
    are_compatible,
    may_be_late,
    queue_depth,
    why_sent,
)
from composer.runtime.messages.ownership import ownership_of
from composer.runtime.tracing.tracer import tracer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rclpy.publisher import Publisher as RosPublisher
    from rclpy.subscription import Subscription as RosSubscription

    from composer.executor import ComposerExecutor
    from composer.executor.sources.inbox import Inbox

# What Fast DDS keeps for a subscription whose history is `keep_all`.
_MOST_KEPT: Final = 5000
_AT_ONCE: Final = Duration(nanoseconds=0)
_NOWHERE: Final = -1


class LocalPublisher:
    """A publisher of the system.

    Args:
        node: The rclpy node that it belongs to.
        returns: Whether it hands over again after it has sent.

    Attributes:
        is_local: Whether it may hand messages over.
        reason: Why its messages are always sent; empty if they are handed over while nobody
            outside listens.
        tap: Called with each message before it goes anywhere; it must not change or keep it. What
            it returns true for goes nowhere.
        published: How many messages it was given.
    """

    def __init__(self, node: Any, ros: RosPublisher, *, is_local: bool, returns: bool) -> None:
        self.node = node
        self.ros = ros
        self.is_local = is_local
        self.reason = ''
        self.tap: Tap | None = None
        self.published = 0
        self._own_reason = why_sent(ros.qos_profile)
        self._always_sends = _always_sends(ros.qos_profile)
        self._returns = returns
        self._ownership = ownership_of(ros.msg_type)
        self._count: Callable[[], int] = ros.handle.get_subscription_count
        self._send = ros.publish
        self._has_sent = False
        self._lock = threading.RLock()  # A finalizer may publish.
        # In one variable: another thread may hand over meanwhile.
        self._receivers: tuple[tuple[Inbox, ...], tuple[Inbox, ...]] = ((), ())
        self._inboxes: tuple[Inbox, ...] = ()
        self._limited: tuple[Inbox, ...] = ()
        self._size = _NOWHERE

    def delivery(self) -> tuple[str, str]:
        """Return which way messages go now: `local` or `sent`, if anywhere; and why sent."""
        try:
            # Other threads ask: it may be destroyed meanwhile, but not within this call.
            listening = self.ros.get_subscription_count()
        except InvalidHandle:
            return '', ''
        outside = max(0, listening - self._size)
        if not listening:
            return '', ''
        if self.reason or not outside:
            return ('sent', self.reason) if self.reason else ('local', '')
        return 'sent', f'{outside} subscription{"" if outside == 1 else "s"} outside'

    def connect(self, subscriptions: Iterable[LocalSubscription]) -> None:
        """Hand messages over to those of the system's subscriptions that match."""
        profile = self.ros.qos_profile
        matched = [each for each in subscriptions if are_compatible(profile, each.ros.qos_profile)]
        # Nothing is handed over meanwhile: the middleware never counts so few.
        self._size = _NOWHERE
        inboxes = [
            (each, each.inbox) for each in matched if each.inbox is not None and not each.waits
        ]
        self._receivers = (
            tuple(inbox for each, inbox in inboxes if not each.read_only),
            tuple(inbox for each, inbox in inboxes if each.read_only),
        )
        self._inboxes = tuple(inbox for _, inbox in inboxes)
        self._limited = tuple(inbox for _, inbox in inboxes if inbox.depth is None)
        turned_off = '' if self.is_local else 'local_delivery: false'
        reasons = [turned_off, self._own_reason, *(each.reason for each in matched)]
        # What it has sent until now may not have been taken yet.
        self._has_sent = self._has_sent or bool(self.reason)
        self.reason = next(filter(None, reasons), '')
        self._size = len(matched)

    def is_heard(self) -> bool:
        """Return whether a message would go anywhere; count it, if not."""
        if self.tap is not None or self._always_sends or self._inboxes or self._count():
            return True
        self.published += 1
        return False

    def publish(self, message: Any, *, is_held: bool) -> None:
        """Hand a message over, or send it.

        Args:
            is_held: Whether somebody refers to it.
        """
        self.published += 1
        # A client that leaves takes it away, in another thread.
        tap = self.tap
        if tap is None or not tap(message):
            self.deliver(message, is_held=is_held)

    def deliver(self, message: Any, *, is_held: bool) -> None:
        """Hand over or send a message that was published."""
        if self.reason:
            self._send(message)
        elif (
            self._has_sent
            or self._count() != self._size
            or (self._limited and self._is_full())
            or (self._returns and self._is_behind())
        ):
            self._send_or_return(message, is_held=is_held)
        else:
            self._hand_over(message, is_held=is_held)

    def _is_full(self) -> bool:
        """Tell whether the middleware must hold back who publishes."""
        return any(len(inbox.messages) >= _MOST_KEPT for inbox in self._limited)

    def _is_behind(self) -> bool:
        """Tell whether messages of others may wait in the middleware.

        Those are older: if the queue is full, they must be dropped first.
        """
        for inbox in self._inboxes:
            source = inbox.source
            if source is not None and source.pending:
                return True
        return False

    def _send_or_return(self, message: Any, *, is_held: bool) -> None:
        with self._lock:
            self._has_sent = (
                (self._has_sent and not self._returns)
                or self._count() != self._size
                or self._is_full()
                or (self._returns and not self._is_drained())
            )
            if self._has_sent:
                self._send(message)
                return
        self._hand_over(message, is_held=is_held)

    def _is_drained(self) -> bool:
        """Tell whether all that was sent has been taken.

        A subscription that is just created may get some of it again: it did not know the publisher
        yet.
        """
        is_known = self.ros.wait_for_all_acked(_AT_ONCE)
        return is_known and all(inbox.is_drained() for inbox in self._inboxes)

    def _hand_over(self, message: Any, *, is_held: bool) -> None:
        inboxes, shared = self._receivers
        if not inboxes and not shared:
            return
        ownership = self._ownership
        message = ownership.take(message, is_held=is_held)
        for inbox in inboxes if shared else inboxes[1:]:
            inbox.put(ownership.copy(message))
        for inbox in shared or inboxes[:1]:
            inbox.put(message)


Tap: TypeAlias = 'Callable[[Any], object]'
FindTap: TypeAlias = 'Callable[[LocalPublisher], Tap | None]'


class LocalSubscription:
    """A subscription of the system.

    Args:
        node: The rclpy node that it belongs to.
        inbox: Takes its messages; `None` if there is a reason to send them.
        reason: Why messages for it are sent.
        read_only: Whether it shares messages with others.
        waits: Whether another one gets its messages until it is replaced.
        what: What a trace calls it.
    """

    def __init__(
        self,
        node: Any,
        ros: RosSubscription,
        inbox: Inbox | None,
        reason: str,
        *,
        read_only: bool,
        waits: bool = False,
        what: str = '',
    ) -> None:
        self.node = node
        self.ros = ros
        self.inbox = inbox
        self.reason = reason
        self.read_only = read_only
        self.waits = waits
        self.what = what


def is_latched(ros: RosPublisher) -> bool:
    """Tell whether subscriptions that come later get messages that were published before."""
    return bool(ros.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL)


def _always_sends(profile: QoSProfile) -> bool:
    """Tell whether a message counts although nobody hears it.

    Those who come later get it, or it is a sign of life.
    """
    return bool(
        profile.durability != DurabilityPolicy.VOLATILE
        or profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
        or profile.deadline.nanoseconds > 0
    )


class _Topic:
    def __init__(self) -> None:
        self.publishers: list[LocalPublisher] = []
        self.subscriptions: list[LocalSubscription] = []

    def follow_tracer(self) -> None:
        """Have what is handed over noted while the tracer is on."""
        for each in self.subscriptions:
            if (inbox := each.inbox) is not None and not each.waits:
                tap = tracer.create_inbox_tap
                inbox.tap = tap(each.node, each.what, inbox) if tracer.is_on else None

    def connect(self) -> None:
        """Find out to which subscriptions each publisher hands over."""
        self.follow_tracer()
        for publisher in self.publishers:
            publisher.connect(self.subscriptions)


def _take_all(ros: RosSubscription) -> Iterator[tuple[Any, tuple[int, int]]]:
    """Yield the messages that wait in the middleware, with what tells them from others."""
    for _ in range(_MOST_KEPT):
        taken = ros.handle.take_message(ros.msg_type, ros.raw)
        if taken is None:
            return
        message, info = taken
        yield message, (info['source_timestamp'], info['publication_sequence_number'])


class LocalTopics:
    """The topics of one system, by their names in the graph and their types."""

    def __init__(self, executor: ComposerExecutor) -> None:
        self._executor = executor
        self._returns = not may_be_late(get_rmw_implementation_identifier(), os.environ)
        self._topics: defaultdict[tuple[str, type], _Topic] = defaultdict(_Topic)
        self._lock = threading.Lock()
        self._finders: list[FindTap] = []

    def tap(self, find_tap: FindTap) -> None:
        """Have `find_tap` say for each publisher, now and later, who is told of its messages."""
        self._finders.append(find_tap)
        self.follow_taps()

    def untap(self, find_tap: FindTap) -> None:
        """Undo `tap`."""
        self._finders.remove(find_tap)
        self.follow_taps()

    def follow_taps(self) -> None:
        """Ask anew who is told of messages; the tracer is while it is on."""
        with self._lock:
            for topic in self._topics.values():
                topic.follow_tracer()
                for publisher in topic.publishers:
                    self._tap_publisher(publisher)

    def _tap_publisher(self, publisher: LocalPublisher) -> None:
        taps = [tap for find_tap in self._finders if (tap := find_tap(publisher)) is not None]
        if tracer.is_on:
            name = publisher.node.get_fully_qualified_name()
            taps.append(tracer.create_tap(name, publisher.ros.topic_name))

        def tell_all(message: Any) -> bool:
            # All are told.
            return sum(bool(tap(message)) for tap in taps) > 0

        publisher.tap = (tell_all if taps[1:] else taps[0]) if taps else None

    def add_publisher(
        self, node: Any, ros: RosPublisher, *, is_local: bool = True
    ) -> LocalPublisher:
        """Take in a publisher of the rclpy node `node`, which may hand over if `is_local`."""
        publisher = LocalPublisher(node, ros, is_local=is_local, returns=self._returns)
        with self._lock:
            topic = self._topic(ros)
            self._tap_publisher(publisher)
            topic.publishers.append(publisher)
            publisher.connect(topic.subscriptions)
        return publisher

    def change_publisher(self, publisher: LocalPublisher, *, is_local: bool) -> None:
        """Let a publisher hand messages over, or only send them."""
        with self._lock:
            publisher.is_local = is_local
            publisher.connect(self._topic(publisher.ros).subscriptions)

    def add_subscription(
        self,
        node: Any,
        ros: RosSubscription,
        *,
        read_only: bool = False,
        reason: str = '',
        waits: bool = False,
        what: str = '',
    ) -> LocalSubscription:
        """Take in a subscription of the rclpy node `node`.

        Args:
            reason: Why only the middleware can deliver to it; empty if that is not so.
            waits: Whether `replace_subscription` gives it another one's messages later.
            what: What a trace calls it.
        """
        reason = reason or why_sent(ros.qos_profile)
        depth = queue_depth(ros.qos_profile)
        inbox = None if reason and not waits else self._executor.open_inbox(node, ros, depth)
        subscription = LocalSubscription(
            node, ros, inbox, reason, read_only=read_only, waits=waits, what=what
        )
        with self._lock:
            topic = self._topic(ros)
            topic.subscriptions.append(subscription)
            topic.connect()
        return subscription

    def add_listener(self, node: Any, ros: RosSubscription) -> LocalSubscription:
        """Take in a subscription that needs no messages: a tap has them.

        Nothing is handed over to it, and nothing is sent for its sake.
        """
        subscription = LocalSubscription(node, ros, None, '', read_only=True)
        with self._lock:
            topic = self._topic(ros)
            topic.subscriptions.append(subscription)
            topic.connect()
        return subscription

    def count_publishers(self, *, leaves_latched: bool = False) -> Counter[str]:
        """Return how many publishers each topic has in this system, of any type.

        Args:
            leaves_latched: Whether those are left out whose messages late subscriptions get.
        """
        with self._lock:
            return Counter(
                name
                for (name, _), topic in self._topics.items()
                for publisher in topic.publishers
                if not (leaves_latched and is_latched(publisher.ros))
            )

    def change_subscription(self, subscription: LocalSubscription, *, read_only: bool) -> None:
        """Let a subscription share messages with others, or have its own."""
        with self._lock:
            subscription.read_only = read_only
            self._topic(subscription.ros).connect()

    def remove_publisher(self, publisher: LocalPublisher) -> None:
        """Forget a publisher."""
        with self._lock:
            self._topic(publisher.ros).publishers.remove(publisher)

    def remove_subscription(self, subscription: LocalSubscription) -> None:
        """Forget a subscription."""
        with self._lock:
            topic = self._topic(subscription.ros)
            topic.subscriptions.remove(subscription)
            topic.connect()

    def replace_subscription(
        self, old: LocalSubscription, new: LocalSubscription, destroy: Callable[[], None]
    ) -> None:
        """Let a subscription that waits get what another one has not run yet, once, in order.

        Until the last step, what is handed over goes by the queue of the old one.

        Args:
            destroy: Destroys the old one's rclpy subscription. After that the middleware has given
                the new one all that it gave the old one since both were there.
        """
        inbox = new.inbox
        assert inbox is not None  # noqa: S101 - it waits
        if old.inbox is not None:
            old.inbox.source = None  # Who has sent goes on to send.
            old.inbox.pass_on(inbox)
        seen = set()
        for message, key in _take_all(old.ros):
            seen.add(key)
            inbox.put(message)
        destroy()
        for message, key in _take_all(new.ros):
            if key not in seen:
                inbox.put(message)
        with self._lock:
            topic = self._topic(new.ros)
            topic.subscriptions.remove(old)
            new.waits = False
            topic.connect()

    def forget(self, node: Any) -> None:
        """Forget all that belongs to an rclpy node."""
        with self._lock:
            for topic in self._topics.values():
                topic.publishers = [each for each in topic.publishers if each.node is not node]
                left = [each for each in topic.subscriptions if each.node is not node]
                if len(left) < len(topic.subscriptions):
                    topic.subscriptions = left
                    topic.connect()

    def _topic(self, ros: RosPublisher | RosSubscription) -> _Topic:
        return self._topics[ros.topic_name, ros.msg_type]
