"""Messages that cross between processes: big ones, and those that were to be handed over."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.placement.crossings import (
    list_crossings,
    locate,
    place_of,
    why_crossing,
)
from composer.interfaces.descriptions import MessageDescription

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.connections.topology import Endpoint
    from composer.checks.context import CheckContext
    from composer.checks.placement.crossings import Crossing, Place
    from composer.diagnostics import Diagnostic
    from composer.interfaces.descriptions import FieldType

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
