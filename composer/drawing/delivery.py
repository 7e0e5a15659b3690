"""Which way messages, calls and goals go by what the file says: handed over, or sent, and why.

A running system may send where the file hands over, as long as somebody outside listens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

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
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.connections.topology import Channel, Endpoint
    from composer.language.specs import QosSpec
    from composer.yaml_text.positions import DataPath

Way: TypeAlias = Literal['local', 'sent', 'both', '']

_TURNED_OFF = 'local_delivery: false'
OUTSIDE: Final = 'external: true'
# One end is in an external process.
PROCESS: Final = 'external process'


@record
class Delivery:
    """The way of what an end sends or gets.

    Attributes:
        way: `local` if it is handed over, `sent`, `both` if it comes from several publishers;
            empty if there is no other end.
        reason: Why it is sent.
    """

    way: Way = ''
    reason: str = ''

    def __str__(self) -> str:
        """Return `sent, durability: transient_local`."""
        return ', '.join(filter(None, (self.way, self.reason)))


def deliveries_of(
    channel: Channel, profiles: Mapping[str, QosSpec]
) -> Iterator[tuple[DataPath, Delivery]]:
    """Yield the path of each end of a channel, and the way of what it sends or gets.

    Args:
        profiles: The named profiles of the file.
    """
    if channel.kind == 'topic':
        yield from _of_topic(channel, profiles)
    else:
        yield from _of_calls(channel, profiles)


def _of_topic(
    channel: Channel, profiles: Mapping[str, QosSpec]
) -> Iterator[tuple[DataPath, Delivery]]:
    policies = {end.path: _policies_of(end, profiles) for end in channel.ends}
    heard: dict[DataPath, list[Delivery]] = {end.path: [] for end in channel.users}
    for publisher in channel.providers:
        offered = policies[publisher.path]
        matched = [each for each in channel.users if _matches(publisher, each, offered, policies)]
        reasons = [
            *(why_crossing(publisher, each) for each in matched),
            '' if getattr(publisher.entity, 'local_delivery', True) else _TURNED_OFF,
            *(_why_sent(policies[each.path]) for each in (publisher, *matched)),
            PROCESS if any(each.is_declared for each in (publisher, *matched)) else '',
            OUTSIDE if getattr(publisher.entity, 'external', False) else '',
        ]
        found = _delivery(reasons) if matched or reasons[-1] else Delivery()
        for each in matched:
            heard[each.path].append(found)
        yield publisher.path, found
    for end in channel.users:
        yield end.path, _join(heard[end.path])


def _of_calls(
    channel: Channel, profiles: Mapping[str, QosSpec]
) -> Iterator[tuple[DataPath, Delivery]]:
    served = [_why_call_is_sent(end, profiles) for end in channel.providers]
    if len(channel.providers) > 1:
        served = ['several servers']
    called: list[Delivery] = []
    for client in channel.users:
        if not channel.providers:
            outside = getattr(client.entity, 'external', False)
            yield client.path, Delivery('sent', OUTSIDE) if outside else Delivery()
            continue
        elsewhere = [why_crossing(client, each) for each in channel.providers]
        called.append(_delivery([*elsewhere, _why_call_is_sent(client, profiles), *served]))
        yield client.path, called[-1]
    for server in channel.providers:
        yield server.path, _join(called)


def _why_call_is_sent(end: Endpoint, profiles: Mapping[str, QosSpec]) -> str:
    if end.is_declared:
        return PROCESS
    if not getattr(end.entity, 'local_delivery', True):
        return _TURNED_OFF
    return _why_sent(_policies_of(end, profiles)) if end.qos else ''


def _why_sent(policies: Mapping[str, Any] | None) -> str:
    return '' if policies is None else why_sent(policies)


def _policies_of(end: Endpoint, profiles: Mapping[str, QosSpec]) -> dict[str, Any] | None:
    """Return the QoS of an end; `None` if it is invalid, which has a finding."""
    try:
        return resolve_qos(end.qos, profiles) if end.qos else None
    except QosError:
        return None


def _matches(
    publisher: Endpoint,
    subscription: Endpoint,
    offered: Mapping[str, Any] | None,
    policies: Mapping[DataPath, Mapping[str, Any] | None],
) -> bool:
    requested = policies[subscription.path]
    if publisher.entity.type != subscription.entity.type or offered is None or requested is None:
        return False
    settled = settle_best_available(offered, BEST_OF_PUBLISHERS)
    return not any(find_qos_conflicts(settled, requested))


def _delivery(reasons: Iterable[str]) -> Delivery:
    reason = next(filter(None, reasons), '')
    return Delivery('sent' if reason else 'local', reason)


def _join(deliveries: list[Delivery]) -> Delivery:
    """Return the way of what comes from several ends."""
    ways = {each.way for each in deliveries}
    reason = next((each.reason for each in deliveries if each.reason), '')
    if len(ways) > 1:
        return Delivery('both', reason)
    return deliveries[0] if deliveries else Delivery()
