"""What crosses between the workers and hosts of a system, and how big that is."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.interfaces.descriptions import MessageDescription
from composer.language.specs import NodeSpec
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from composer.checks.connections.topology import Channel, Endpoint, Topology
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.interfaces.descriptions import FieldType

# A host and a worker; empty for those that the file does not name.
Place: TypeAlias = tuple[str, str]
# Of more ends, the first are named.
_MOST_NAMED = 4
# Messages that are made to hold pictures, clouds of points or maps.
_BIG = frozenset(
    (
        'map_msgs/msg/PointCloud2Update',
        'nav_msgs/msg/OccupancyGrid',
        'sensor_msgs/msg/Image',
        'sensor_msgs/msg/PointCloud',
        'sensor_msgs/msg/PointCloud2',
        'stereo_msgs/msg/DisparityImage',
        'theora_image_transport/msg/Packet',
    )
)
_SIZES = {'bool': 1, 'byte': 1, 'char': 1, 'float32': 4, 'float64': 8}
_SIZES |= {f'{sign}int{bits}': bits // 8 for sign in ('', 'u') for bits in (8, 16, 32, 64)}
# Above this Fast DDS sends a message in several datagrams.
_BIG_BYTES = 64 * 1024
_DEEPEST = 8
_LOCAL = 'local_delivery'


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
        ends = [end for end in channel.ends if not hosts or place_of(end)[0] in ('', *hosts)]
        senders = [end for end in ends if end.kind.sends]
        receivers = [end for end in ends if not end.kind.sends]
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


def check_crossing_messages(context: CheckContext) -> Iterator[Diagnostic]:
    """Check what crosses between workers and hosts, if there are any."""
    for crossing in list_crossings(context):
        yield from _check_promises(context, crossing)
        if crossing.channel.kind == 'topic':
            yield from _check_size(context, crossing)


def _check_size(context: CheckContext, crossing: Crossing) -> Iterator[Diagnostic]:
    """Check that a topic has no big messages; a publisher is reported once."""
    # The first of each place, as there may be thousands.
    receivers: dict[Place, Endpoint] = {}
    for each in crossing.receivers:
        if not each.is_declared:
            receivers.setdefault(place_of(each), each)
    for publisher in crossing.senders:
        elsewhere = (each for each in receivers.values() if why_crossing(publisher, each))
        subscription = None if publisher.is_declared else next(elsewhere, None)
        if subscription is None:
            continue
        if not is_big(context, publisher.entity.type):
            continue
        where = locate(place_of(publisher)), locate(place_of(subscription))
        yield context.at_key(
            publisher.path,
            'big-crossing-message',
            f"each {publisher.entity.type} of '{publisher.entity.name}' is copied from "
            f"'{publisher.node.name}' {where[0]} to '{subscription.node.name}' {where[1]}",
            help='let both run in one worker, or send less: fewer, smaller or compressed messages',
            related=[context.related(subscription.path, 'the subscription is here')],
        )


def _check_promises(context: CheckContext, crossing: Crossing) -> Iterator[Diagnostic]:
    """Check that ends which are to hand over have another end in their process."""
    channel = crossing.channel
    users, providers = (
        {place_of(each) for each in ends if not each.is_declared}
        for ends in (channel.users, channel.providers)
    )
    for end in (*crossing.senders, *crossing.receivers):
        path = (*end.path, _LOCAL)
        # It is true by default, which promises nothing.
        if path not in context.system.positions.values or not getattr(end.entity, _LOCAL, False):
            continue
        if place_of(end) not in (users if end.kind.provides else providers):
            others = channel.users if end.kind.provides else channel.providers
            yield context.at_value(
                path,
                'not-handed-over',
                f"'{end.node.name}' runs {locate(place_of(end))}, and no other end of "
                f'{channel.kind} {channel.name} does: nothing is handed over',
                help=f"remove '{_LOCAL}', or let both ends run in one worker",
                related=[context.related(others[0].path, 'the other end is here')],
            )


def is_big(context: CheckContext, type_name: str, depth: int = 0) -> bool:
    """Return whether messages of a type are big by their definition, or by what they are for."""
    if type_name in _BIG:
        return True
    description = context.types.describe(type_name)
    if not isinstance(description, MessageDescription) or depth > _DEEPEST:
        return False
    return any(
        is_big(context, field.type.nested, depth + 1)
        if field.type.nested
        else _SIZES.get(field.type.kind, 0) * _count_items(field.type) >= _BIG_BYTES
        for field in description.fields
    )


def _count_items(field_type: FieldType) -> int:
    """Return how many items a field has for sure."""
    return field_type.array_bound or 1 if field_type.array == 'fixed' else 1
