"""Systems of the same name on the ROS graph, on other hosts too: the later one ends.

Each tells how long it has been running whenever another one comes in sight. Who has been running
for as long or longer refuses the other, so the one that was there first stays. Of two that began
within the same moment, each may refuse the other; then the one with the lower ID stays. No clocks
are compared, and a system that is alone waits for nobody.
"""

from __future__ import annotations

import json
import secrets
from time import monotonic
from typing import TYPE_CHECKING, Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import QoSProfile

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rclpy.callback_groups import CallbackGroup
    from rclpy.node import Node as RosNode

_TOPIC = '~/claims'
_DEPTH = 100


class Rivals:
    """Finds systems of the same name, and tells who of them must end.

    Args:
        node: The control node; all that have its name hear each other.
        about: What others are told of this system.
        begun: When it began, by `time.monotonic`.
        refused: Called with what the other says of itself, if this system must end.
    """

    def __init__(
        self,
        node: RosNode,
        group: CallbackGroup,
        about: Mapping[str, Any],
        begun: float,
        refused: Callable[[Mapping[str, Any]], None],
    ) -> None:
        from std_msgs.msg import String

        self._message_class = String
        self._id = secrets.token_hex(8)
        self._about = about
        self._begun = begun
        self._refused = refused
        self._refuses: set[str] = set()
        self._is_refused = False
        qos = QoSProfile(depth=_DEPTH)
        node.create_subscription(String, _TOPIC, self._hear, qos, callback_group=group)
        self._publisher = node.create_publisher(
            String,
            _TOPIC,
            qos,
            callback_group=group,
            event_callbacks=PublisherEventCallbacks(matched=lambda _event: self._tell()),
        )

    def _tell(self, refuses: str = '') -> None:
        claim = {
            'id': self._id,
            'running_sec': monotonic() - self._begun,
            'refuses': refuses,
            'about': dict(self._about),
        }
        self._publisher.publish(self._message_class(data=json.dumps(claim)))

    def _hear(self, message: Any) -> None:
        try:
            claim = json.loads(message.data)
            other, running_sec = str(claim['id']), float(claim['running_sec'])
            refuses, about = claim['refuses'], dict(claim['about'])
        except (ValueError, KeyError, TypeError, RecursionError):
            return  # Somebody else publishes there.
        if other == self._id or self._is_refused:
            return
        if refuses == self._id:
            if other not in self._refuses or other < self._id:
                self._is_refused = True
                self._refused(about)
        elif not refuses and monotonic() - self._begun >= running_sec:
            self._refuses.add(other)
            self._tell(refuses=other)
