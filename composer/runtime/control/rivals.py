"""Systems of the same name on the ROS graph, on other hosts too: the later one ends.

Each tells how long it has been running whenever another one comes in sight, and whenever it hears
of one that must end. Who hears of one that has been running for longer ends. Of those that began
within the same moment, one stays, whichever it is. No clocks are compared, and a system that is
alone waits for nobody.
"""

from __future__ import annotations

import json
import os
from time import monotonic
from typing import TYPE_CHECKING, Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rclpy.node import Node as RosNode

_TOPIC = '~/claims'
# The last claim is kept for those who find this system later than it finds them.
CLAIMS_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_DEPTH = 100
# Claims take less time than that, as a rule; those that take more settle nothing.
MOMENT_SEC = 1.0


class Standing:
    """Whether one system may stay, after all that it has heard.

    Its rank is how many moments it has been running, and among those of as many its ID. It gives
    way to a rank that is higher than its own is now, and tells nothing from then on. So never do
    all give way, however late claims are, and whichever get lost: a rank only grows, and of those
    that were given way to, the highest is that of one who stays.

    Args:
        own_id: Its ID.
        begun: When it began.
        clock: Returns the time, in seconds.

    Attributes:
        gives_way: Whether it must end.
    """

    def __init__(self, own_id: str, begun: float, clock: Callable[[], float] = monotonic) -> None:
        self._id = own_id
        self._begun = begun
        self._clock = clock
        self.gives_way = False

    def tell(self) -> dict[str, Any]:
        """Return a claim; only one that does not give way may make it."""
        return {'id': self._id, 'running_sec': self._clock() - self._begun}

    def hear(self, claim: Mapping[str, Any]) -> bool:
        """Take the claim of another; return whether that one must end, and so must be told.

        Raises:
            KeyError, TypeError, ValueError: It is no claim.
        """
        other, own = _rank(claim), _rank(self.tell())
        if claim['id'] == self._id:
            return False
        self.gives_way = self.gives_way or other > own
        return other < own and not self.gives_way


def _rank(claim: Mapping[str, Any]) -> tuple[float, str]:
    return float(claim['running_sec']) // MOMENT_SEC, str(claim['id'])


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
        about: Mapping[str, Any],
        begun: float,
        refused: Callable[[Mapping[str, Any]], None],
    ) -> None:
        from std_msgs.msg import String

        self._message_class = String
        self._standing = Standing(os.urandom(8).hex(), begun)
        self._about = about
        self._refused = refused
        # What is told was so before it gave way.
        group = MutuallyExclusiveCallbackGroup()
        qos = QoSProfile(depth=_DEPTH, durability=CLAIMS_QOS.durability)
        node.create_subscription(String, _TOPIC, self._hear, qos, callback_group=group)
        self._publisher = node.create_publisher(
            String,
            _TOPIC,
            CLAIMS_QOS,
            callback_group=group,
            event_callbacks=PublisherEventCallbacks(matched=lambda _event: self._tell()),
        )

    def _tell(self) -> None:
        if not self._standing.gives_way:
            claim = {**self._standing.tell(), 'about': dict(self._about)}
            self._publisher.publish(self._message_class(data=json.dumps(claim)))

    def _hear(self, message: Any) -> None:
        if self._standing.gives_way:
            return
        try:
            claim = json.loads(message.data)
            about = dict(claim['about'])
            must_end = self._standing.hear(claim)
        except (ValueError, KeyError, TypeError, RecursionError):
            return  # Somebody else publishes there.
        if must_end:
            self._tell()
        elif self._standing.gives_way:
            self._refused(about)
