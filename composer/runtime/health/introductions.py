"""Introduces this process again to those that lost it, as when a cable was cut for a while.

Fast DDS takes a participant for gone when it has heard nothing of it for 20 s. When it comes back,
publishers and subscriptions meet again, but the names of its nodes stay unknown: rmw_fastrtps
forgets them with the participant, and Fast DDS does not give again what it has given before. They
are known again as soon as anything of that participant's nodes changes. So who finds a participant
again adds a publisher, which names its own nodes to the others and asks them to do the same: one
of both may not have noticed that the other was gone.
"""

from __future__ import annotations

from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.exceptions import InvalidHandle

if TYPE_CHECKING:
    from rclpy.node import Node as RosNode
    from rclpy.publisher import Publisher

# Each participant has this topic of rmw_dds_common, where it tells the names of its nodes.
_NAMES = 'ros_discovery_info'
_REQUESTS = '/_composer_introduce'
_INTRODUCTION = '/_composer_introduction'
# The first part of the ID of each publisher is that of its participant.
_ID_BYTES = 12
# Others look once a second.
_REQUEST_SEC = 6.0
# Of so many participants that are gone; each run of a tool is one.
_MOST_LOST = 1000


class Introductions:
    """What this process does about participants that come back."""

    def __init__(self) -> None:
        self._present: set[bytes] = set()
        self._lost: dict[bytes, None] = {}
        self._known_requests: set[bytes] = set()
        self._request: tuple[RosNode, Publisher, float] | None = None

    def check(self, node: RosNode) -> None:
        """Look for participants that are back, and for requests of others.

        Args:
            node: One of this process.
        """
        self._end_request()
        infos = node.get_publishers_info_by_topic(_NAMES, no_mangle=True)
        present = {bytes(info.endpoint_gid[:_ID_BYTES]) for info in infos}
        returned = present & self._lost.keys()
        self._note(present)
        requests = {
            bytes(info.endpoint_gid) for info in node.get_publishers_info_by_topic(_REQUESTS)
        }
        new, self._known_requests = requests - self._known_requests, requests
        if returned and self._request is None:
            self._request = node, _add_publisher(node, _REQUESTS), monotonic() + _REQUEST_SEC
            self._known_requests |= {
                bytes(info.endpoint_gid) for info in node.get_publishers_info_by_topic(_REQUESTS)
            }
        elif new:
            node.destroy_publisher(_add_publisher(node, _INTRODUCTION))

    def _note(self, present: set[bytes]) -> None:
        self._lost |= dict.fromkeys(self._present - present)
        for each in present & self._lost.keys():
            del self._lost[each]
        for each in list(self._lost)[:-_MOST_LOST]:
            del self._lost[each]
        self._present = present

    def _end_request(self) -> None:
        if self._request is not None and monotonic() > self._request[-1]:
            node, publisher, _ = self._request
            self._request = None
            # Its node may be gone.
            with suppress(InvalidHandle):
                node.destroy_publisher(publisher)


def _add_publisher(node: RosNode, topic: str) -> Publisher:
    # It imports all messages of its package, and hardly any process needs it.
    from std_msgs.msg import Empty

    # Nothing is ever sent: that it is there says all.
    events = PublisherEventCallbacks(use_default_callbacks=False)
    return node.create_publisher(Empty, topic, 1, event_callbacks=events)
