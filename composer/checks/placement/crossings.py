"""What crosses between the workers and hosts of a system, as its file places them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.language.specs import NodeSpec
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from composer.checks.connections.topology import Channel, Endpoint, Topology
    from composer.checks.context import CheckContext

# A host and a worker; empty for those that the file does not name.
Place: TypeAlias = tuple[str, str]
# Of more ends, the first are named.
_MOST_NAMED = 4


@record
class Crossing:
    """A topic, service or action with ends in several processes of the system.

    Attributes:
        channel: The topic, service or action.
        senders: Who sends messages, requests or goals to somebody elsewhere.
        receivers: Who gets them from elsewhere.
    """

    channel: Channel
    senders: tuple[Endpoint, ...]
    receivers: tuple[Endpoint, ...]

    def __str__(self) -> str:
        """Return `topic /image: camera (worker vision) → planner`."""
        ends = f'{_list(self.senders)} → {_list(self.receivers)}'
        return f'{self.channel.kind} {self.channel.name}: {ends}'


def find_crossings(topology: Topology, hosts: Collection[str] = ()) -> Iterator[Crossing]:
    """Yield what crosses, in the order of the file.

    Args:
        hosts: Those of the inventory, if there is one: what is on another host is left out, since
            that is an error of its own.
    """
    for channel in topology.channels.values():
        senders, receivers = (
            [each for each in ends if not hosts or place_of(each)[0] in ('', *hosts)]
            for ends in (channel.providers, channel.users)
        )
        if channel.kind != 'topic':
            senders, receivers = receivers, senders
        from_here = tuple(_list_crossing(senders, receivers))
        if from_here:
            yield Crossing(channel, from_here, tuple(_list_crossing(receivers, senders)))


def list_crossings(context: CheckContext) -> list[Crossing]:
    """Return what crosses in a system; nothing if it has neither workers nor hosts."""
    spec = context.spec
    has_hosts = any(each.host for each in spec.nodes.values()) or any(
        each.host for each in spec.processes.values()
    )
    return [*find_crossings(context.topology, spec.hosts)] if spec.workers or has_hosts else []


def _list_crossing(ends: list[Endpoint], others: list[Endpoint]) -> Iterator[Endpoint]:
    """Yield the ends of which one of the others is elsewhere."""
    # One of each place, as there may be thousands.
    places = {(place_of(each), each.is_declared): each for each in others}.values()
    return (end for end in ends if any(why_crossing(end, other) for other in places))


def place_of(end: Endpoint) -> Place:
    """Return where an end is; an external process is in no worker."""
    return end.node.host, end.node.worker if isinstance(end.node, NodeSpec) else ''


def why_crossing(one: Endpoint, other: Endpoint) -> str:
    """Return `other host`, or `other worker`; empty if two ends are in one process.

    External processes are on hosts, and not compared with workers: each is a process of its own.
    """
    (host, worker), (other_host, other_worker) = place_of(one), place_of(other)
    if host != other_host:
        return 'other host'
    are_processes = one.is_declared or other.is_declared
    return 'other worker' if worker != other_worker and not are_processes else ''


def describe_place(place: Place) -> str:
    """Return `worker vision on host jetson`; empty for a place without names."""
    host, worker = place
    parts = [f'worker {worker}' if worker else '', f'host {host}' if host else '']
    return ' on '.join(filter(None, parts))


def locate(place: Place) -> str:
    """Return `in worker vision on host jetson`, with the words that fit."""
    host, worker = place
    where = describe_place(place) or 'the process of the system'
    return f'on {where}' if host and not worker else f'in {where}'


def _list(ends: Iterable[Endpoint]) -> str:
    named = dict.fromkeys(map(_label, ends))
    shown = [*named][:_MOST_NAMED]
    return ', '.join([*shown, '…'] if len(named) > len(shown) else shown)


def _label(end: Endpoint) -> str:
    place = describe_place(place_of(end))
    name = end.node.name if isinstance(end.node, NodeSpec) else end.node.process
    return f'{name} ({place})' if place else name
