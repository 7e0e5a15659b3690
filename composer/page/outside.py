"""The publishers and subscriptions of other programs at the topics of a system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.names import join_names

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

_MOST_ENDS = 50
_LONGEST_NAME = 200
# Composer's own tools, as the page itself; and an end may be known before its node is.
_UNSHOWN = ('_composer_client_', '_NODE_NAME_UNKNOWN_')


def find_outside(
    node: Any, topics: Iterable[str], own: Collection[str]
) -> dict[str, list[dict[str, str]]]:
    """Return the ends outside of a system, by the full names of topics.

    Each has `kind`, `node` and `type`; where no message can go, `problem`, and the node of the
    system that has it, `problem_at`.

    Args:
        node: A node of rclpy.
        own: The full names of the system's nodes.
    """
    outside = {}
    for topic in topics:
        ends = [
            (join_names(end.node_namespace, end.node_name), end)
            for end in (
                *node.get_publishers_info_by_topic(topic),
                *node.get_subscriptions_info_by_topic(topic),
            )
        ]
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
        if listed:
            listed.sort(key=lambda end: (end['kind'], end['node'], end['type']))
            outside[topic] = listed[:_MOST_ENDS]
    return outside


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
