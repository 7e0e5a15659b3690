"""Tells when the part of another host is gone, with what is lost, and when it is there again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name
from composer.runtime.control.protocol import node_name
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from rclpy.node import Node as RosNode

    from composer.language.specs import SystemSpec

# The processes of a host go within the 3 s between two announcements of Fast DDS.
_MOST_MISSED = 5
_MOST_TOPICS = 5


class OtherHosts:
    """The parts of the system on other hosts, by the nodes that answer for them.

    Args:
        spec: The part of this host.
    """

    def __init__(self, spec: SystemSpec) -> None:
        others = [host for host in spec.hosts if spec.host and host != spec.host]
        self._hosts = {node_name(f'{spec.name}@{host}'): host for host in others}
        self._topics = sorted(
            {
                full_name(node, 'topic', each.topic)
                for node in spec.nodes.values()
                for each in node.subscriptions.values()
            }
        )
        # How often a host that was there has been missed since.
        self._missed: dict[str, int] = {}

    def check(self, node: RosNode) -> None:
        """Look who is there."""
        if not self._hosts:
            return
        names = {*node.get_node_names()}
        for name, host in self._hosts.items():
            if name in names:
                if self._missed.get(host, 0) >= _MOST_MISSED:
                    system_logger.info(f"host '{host}' is there again")
                self._missed[host] = 0
            elif host in self._missed:
                self._missed[host] += 1
                if self._missed[host] == _MOST_MISSED:
                    system_logger.warning(f"host '{host}' is gone{self._describe_losses(node)}")

    def _describe_losses(self, node: RosNode) -> str:
        lost = [topic for topic in self._topics if not node.count_publishers(topic)]
        if not lost:
            return ''
        rest = len(lost) - _MOST_TOPICS
        shown = ', '.join(f"'{each}'" for each in lost[:_MOST_TOPICS])
        more = f' and {rest} more' if rest > 0 else ''
        return f': {shown}{more} {"has" if len(lost) == 1 else "have"} no publisher'
