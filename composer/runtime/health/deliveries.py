"""Which way the messages and calls of a running system go: handed over, or sent, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.records import record
from composer.runtime.behaviours.running_calls import Owner

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.runtime.health.statistics import EntityKey
    from composer.runtime.nodes.live_node import LiveNode

Deliveries: TypeAlias = 'dict[EntityKey, Delivery]'

_SENDING = {
    'publishers': 'publisher',
    'service_clients': 'service client',
    'action_clients': 'action client',
}


@record
class Delivery:
    """Which way an entity delivers now.

    Attributes:
        way: `local`, or `sent`; empty if nobody listens.
        reason: Why it is sent.
        count: How many messages, requests or goals it has sent or handed over.
    """

    way: str
    reason: str
    count: int

    def __str__(self) -> str:
        """Return `sent, 1 subscription outside`."""
        return ', '.join(filter(None, (self.way, self.reason)))


def find_deliveries(nodes: Iterable[LiveNode]) -> Deliveries:
    """Return the way of each publisher and client."""
    return {
        (node.full_name, Owner(noun, name)): Delivery(*entity.delivery())  # type: ignore[attr-defined]
        for node in nodes
        for section, noun in _SENDING.items()
        for name, entity in list(node.entities[section].items())
    }
