"""Tells when the part of another host is gone, with what is lost, and when it is there again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name
from composer.runtime.control.protocol import node_name
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node as RosNode

    from composer.language.specs import SystemSpec

# The processes of a host go within the 3 s between two announcements of Fast DDS.
_MOST_MISSED = 5
_MOST_TOPICS = 5


class OtherHosts:
    """The parts of the system on other hosts, by the nodes that answer for them.

    Args:
        find_spec: Returns the part of this host, as it is now.
    """

    def __init__(self, find_spec: Callable[[], SystemSpec]) -> None:
        self._find_spec = find_spec
        # How often a host that was there has been missed since.
        self._missed: dict[str, int] = {}

    def check(self, node: RosNode) -> None:
        """Look who is there."""
        spec = self._find_spec()
        others = [host for host in spec.hosts if spec.host and host != spec.host]
        if not others:
            return
        names = {*node.get_node_names()}
        for host in others:
            name = node_name(f'{spec.name}@{host}')
            if name in names:
                if self._missed.get(host, 0) >= _MOST_MISSED:
                    system_logger.info(f"host '{host}' is there again")
                self._missed[host] = 0
            elif host in self._missed:
                self._missed[host] += 1
                if self._missed[host] == _MOST_MISSED:
                    system_logger.warning(f"host '{host}' is gone{_describe_losses(spec, node)}")


def _describe_losses(spec: SystemSpec, node: RosNode) -> str:
    topics = {
        full_name(each, 'topic', subscription.topic)
        for each in spec.nodes.values()
        for subscription in each.subscriptions.values()
    }
    lost = [topic for topic in sorted(topics) if not node.count_publishers(topic)]
    if not lost:
        return ''
    rest = len(lost) - _MOST_TOPICS
    shown = ', '.join(f"'{each}'" for each in lost[:_MOST_TOPICS])
    more = f' and {rest} more' if rest > 0 else ''
    return f': {shown}{more} {"has" if len(lost) == 1 else "have"} no publisher'
