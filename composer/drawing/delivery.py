"""Which way messages, calls and goals go by what the file says: handed over, or sent, and why.

A running system may send where the file hands over, as long as somebody outside listens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from composer.checks.placement.crossings import why_crossing
from composer.language.qos import (
    BEST_OF_PUBLISHERS,
    QosError,
    resolve_qos,
    settle_best_available,
    why_sent,
)
from composer.language.qos_conflicts import find_qos_conflicts
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.checks.connections.topology import Channel, Endpoint
    from composer.language.specs import QosSpec
    from composer.yaml_text.positions import DataPath

OUTSIDE: Final = 'external: true'


@record
class Delivery:
    """The way of what an end sends or gets.

    Attributes:
        way: `local` if it is handed over, `sent`, `both` if it comes from several publishers;
            empty if there is no other end.
        reason: Why it is sent.
    """

    way: str = ''
    reason: str = ''

    def __str__(self) -> str:
        """Return `sent, durability: transient_local`."""
        return ', '.join(filter(None, (self.way, self.reason)))


def deliveries_of(channel: Channel, profiles: Mapping[str, QosSpec]) -> dict[DataPath, Delivery]:
    """Return the way of what each end of a channel sends or gets, by the path of the end."""
    is_topic = channel.kind == 'topic'
    policies = {end.path: policies_of(end, profiles) for end in channel.ends}
    senders = [end for end in channel.ends if end.kind.sends]
    receivers = [end for end in channel.ends if not end.kind.sends]
    sent: dict[DataPath, Delivery] = {}
    heard: dict[DataPath, list[Delivery]] = {end.path: [] for end in receivers}
    for sender in senders:
        matched = [end for end in receivers if not is_topic or _matches(sender, end, policies)]
        ends = (sender, *matched)
        # A call goes to one server.
        goes_outside = getattr(sender.entity, 'external', False) and (is_topic or not matched)
        reasons = [
            *(why_crossing(sender, end) for end in matched),
            *(
                '' if getattr(end.entity, 'local_delivery', True) else 'local_delivery: false'
                for end in ends
            ),
            *(why_sent(known) for end in ends if (known := policies[end.path])),
            'external process' if any(end.is_declared for end in ends) else '',
            'several servers' if not is_topic and len(matched) > 1 else '',
            OUTSIDE if goes_outside else '',
        ]
        reason = next(filter(None, reasons), '')
        delivery = Delivery('sent' if reason else 'local', reason)
        sent[sender.path] = delivery if matched or goes_outside else Delivery()
        for end in matched:
            heard[end.path].append(delivery)
    return sent | {path: _join(deliveries) for path, deliveries in heard.items()}


def policies_of(end: Endpoint, profiles: Mapping[str, QosSpec]) -> dict[str, Any] | None:
    """Return the QoS of an end; `None` if it is invalid, which has a finding."""
    try:
        return resolve_qos(end.qos, profiles) if end.qos else None
    except QosError:
        return None


def _matches(
    publisher: Endpoint,
    subscription: Endpoint,
    policies: Mapping[DataPath, Mapping[str, Any] | None],
) -> bool:
    offered, requested = policies[publisher.path], policies[subscription.path]
    if publisher.entity.type != subscription.entity.type or offered is None or requested is None:
        return False
    settled = settle_best_available(offered, BEST_OF_PUBLISHERS)
    return not any(find_qos_conflicts(settled, requested))


def _join(deliveries: list[Delivery]) -> Delivery:
    """Return the way of what comes from several ends."""
    ways = {each.way for each in deliveries}
    reason = next((each.reason for each in deliveries if each.reason), '')
    return Delivery('both' if len(ways) > 1 else next(iter(ways), ''), reason)
