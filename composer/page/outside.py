"""The publishers and subscriptions of other programs at the topics of a system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.names import join_names

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

_MOST_ENDS = 50
_LONGEST_NAME = 200
# An end may be known before its node is.
_UNKNOWN = '_NODE_NAME_UNKNOWN_'
# Composer's own tools, as the page itself, and who is not known yet.
_UNSHOWN = ('_composer_client_', _UNKNOWN)


class OutsideEnds:
    """Compares the ends that the ROS graph has with the nodes of a system.

    Attributes:
        by_topic: `kind`, `node` and `type` of each end, by the full names of topics; where no
            message can go, `problem`, and the node of the system that has it, `problem_at`.
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
        for topic, count in list(counts.items()):
            # What has only ends of its own is asked for again when their number changes.
            if topic in ends or count != self._counts.get(topic):
                found = [
                    (join_names(end.node_namespace, end.node_name), end)
                    for end in (
                        *node.get_publishers_info_by_topic(topic),
                        *node.get_subscriptions_info_by_topic(topic),
                    )
                ]
                ends[topic] = _list_ends(topic, found, own)
                if any(end.node_name == _UNKNOWN for _, end in found):
                    del counts[topic]
        self._counts, before = counts, self.by_topic
        self.by_topic = {topic: listed for topic, listed in ends.items() if listed}
        return self.by_topic != before


def _list_ends(
    topic: str, ends: list[tuple[str, Any]], own: Collection[str]
) -> list[dict[str, str]]:
    """Return the ends outside among all ends of a topic, each of which has its node's name."""
    ends_here = [each for each in ends if each[0] in own]
    listed = [
        {
            'kind': end.endpoint_type.name.lower(),
            'node': name[:_LONGEST_NAME],
            'type': end.topic_type[:_LONGEST_NAME],
            **_find_problem(topic, name, end, ends_here),
        }
        for name, end in ends
        if name not in own and not end.node_name.startswith(_UNSHOWN)
    ]
    return sorted(listed, key=lambda end: (end['kind'], end['node'], end['type']))[:_MOST_ENDS]


def _find_problem(
    topic: str, name: str, end: Any, ends_here: Iterable[tuple[str, Any]]
) -> dict[str, str]:
    """Return why no message goes between an end outside and one of the system, and which."""
    from composer.runtime.health.unmatched import find_mismatch
    from composer.runtime.messages.qos_profiles import read_policies

    for node, here in ends_here:
        if here.endpoint_type == end.endpoint_type:
            continue
        publishes = here.endpoint_type.name == 'PUBLISHER'
        policies = read_policies(here.qos_profile)
        if reason := find_mismatch(end, here.topic_type, policies, publishes=publishes):
            what = 'sends nothing to' if publishes else 'gets nothing from'
            return {'problem': f'{topic} of {node} {what} {name}: {reason}', 'problem_at': node}
    return {}
