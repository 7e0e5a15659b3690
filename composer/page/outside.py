"""The publishers and subscriptions of other programs at the topics of a system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.names import join_names

if TYPE_CHECKING:
    from collections.abc import Collection

_MOST_ENDS = 50
_LONGEST_NAME = 200
# Composer's own tools, as the page itself, and who is not known yet.
_UNSHOWN = ('_composer_client_', '_NODE_NAME_UNKNOWN_')


class OutsideEnds:
    """Compares the ends that the ROS graph has with the nodes of a system.

    Attributes:
        by_topic: `kind`, `node` and `type` of each end, by the full names of topics.
    """

    def __init__(self) -> None:
        self.by_topic: dict[str, list[dict[str, str]]] = {}
        self._counts: dict[str, tuple[int, int]] = {}

    def forget(self) -> None:
        """Ask for all topics the next time."""
        self._counts = {}

    def look(self, node: Any, topics: Collection[str], own: Collection[str]) -> bool:
        """Ask the graph; return whether its ends have changed.

        Args:
            node: A node of rclpy.
            topics: The full names of topics.
            own: The full names of the system's nodes.
        """
        ends = {topic: self.by_topic[topic] for topic in topics if topic in self.by_topic}
        counts = {
            topic: (node.count_publishers(topic), node.count_subscribers(topic))
            for topic in topics
        }
        for topic, count in counts.items():
            # What has only ends of its own is asked for again when their number changes.
            if topic in ends or count != self._counts.get(topic):
                ends[topic] = _list_ends(node, topic, own)
        ends = {topic: found for topic, found in ends.items() if found}
        self._counts, before = counts, self.by_topic
        self.by_topic = ends
        return ends != before


def _list_ends(node: Any, topic: str, own: Collection[str]) -> list[dict[str, str]]:
    found = [
        {'kind': kind, 'node': name[:_LONGEST_NAME], 'type': end.topic_type[:_LONGEST_NAME]}
        for kind, ends in (
            ('publisher', node.get_publishers_info_by_topic(topic)),
            ('subscription', node.get_subscriptions_info_by_topic(topic)),
        )
        for end in ends
        if (name := join_names(end.node_namespace, end.node_name)) not in own
        and not end.node_name.startswith(_UNSHOWN)
    ]
    return sorted(found, key=lambda end: (end['kind'], end['node'], end['type']))[:_MOST_ENDS]
