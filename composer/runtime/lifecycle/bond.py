"""A bond: who manages a node hears its heartbeat on a topic, and notices that it has died.

It follows `bond_core`: both ends publish `bond/msg/Status` under one identifier, here the node's
name, as the nodes of nav2 do. As there, the node does not mind that its manager dies.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.exceptions import InvalidHandle
from rclpy.qos import QoSProfile

from composer.interfaces.classes import import_interface

if TYPE_CHECKING:
    from composer.runtime.nodes.live_node import LiveNode

_TOPIC: Final = 'bond'
_TYPE: Final = 'bond/msg/Status'
# Those of nav2's nodes.
_HEARTBEAT_PERIOD_SEC: Final = 0.25
_HEARTBEAT_TIMEOUT_SEC: Final = 4.0
# Those of bondcpp.
_CONNECT_TIMEOUT_SEC: Final = 10.0
_PUBLISHED_DEPTH: Final = 5
_HEARD_DEPTH: Final = 100
_LAST_WORD: Final = Duration(seconds=0.1)


class Bond:
    """The end of a bond that a node keeps.

    Its heart stops while a behaviour of the node exceeds its `warn_after`: the bond is to break
    when the node hangs.
    """

    def __init__(self, node: LiveNode) -> None:
        self._node = node
        self._lock = threading.Lock()
        self._ends: tuple[Any, Any, Any] | None = None

    def form(self) -> None:
        """Begin a bond, unless there is one."""
        with self._lock:
            if self._ends is not None:
                return
            ros, group, kind = self._node.ros, self._node.background, import_interface(_TYPE)
            from uuid import uuid4  # Few nodes have a bond.

            self._instance = str(uuid4())
            self._begun = monotonic()
            self._is_alive, self._has_sister = True, False
            publisher = ros.create_publisher(kind, _TOPIC, QoSProfile(depth=_PUBLISHED_DEPTH))
            self._publisher, self._kind = publisher, kind
            subscription = ros.create_subscription(
                kind, _TOPIC, self._hear, QoSProfile(depth=_HEARD_DEPTH), callback_group=group
            )
            timer = ros.create_timer(
                _HEARTBEAT_PERIOD_SEC,
                self._beat,
                callback_group=group,
                clock=Clock(clock_type=ClockType.STEADY_TIME),
            )
            self._ends = publisher, subscription, timer
        self._beat()

    def break_up(self) -> None:
        """Tell the other end that the bond ends, if there is one."""
        with self._lock:
            if self._ends is None:
                return
            (publisher, subscription, timer), self._ends = self._ends, None
        ros = self._node.ros
        with suppress(InvalidHandle):
            ros.destroy_timer(timer)
            ros.destroy_subscription(subscription)
            if self._is_alive:
                self._say(is_active=False)
                publisher.wait_for_all_acked(_LAST_WORD)
            ros.destroy_publisher(publisher)

    def _beat(self) -> None:
        is_late = not self._has_sister and monotonic() - self._begun > _CONNECT_TIMEOUT_SEC
        if self._is_alive and not is_late and not self._hangs():
            self._say(is_active=True)

    def _hear(self, status: Any) -> None:
        if status.id != self._node.ros.get_name() or status.instance_id == self._instance:
            return
        self._has_sister = True
        if not status.active and self._is_alive:
            self._is_alive = False
            self._say(is_active=False)

    def _say(self, *, is_active: bool) -> None:
        ros = self._node.ros
        message = self._kind(
            id=ros.get_name(),
            instance_id=self._instance,
            active=is_active,
            heartbeat_timeout=_HEARTBEAT_TIMEOUT_SEC,
            heartbeat_period=_HEARTBEAT_PERIOD_SEC,
        )
        message.header.stamp = ros.get_clock().now().to_msg()
        with suppress(InvalidHandle):
            self._publisher.publish(message)

    def _hangs(self) -> bool:
        """Return whether a behaviour has been running for too long; goals may."""
        limits = self._node.limits
        return any(
            call.thread is not None and call.owner.kind != 'action' and limit.is_exceeded_by(call)
            for call in self._node.running.calls()
            if (limit := limits.get(call.owner)) is not None
        )
