"""Check that a topic, service or action has one type, and one server."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from composer.names import with_article

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.connections.topology import Channel, Endpoint
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic


def check_channel_types(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that all ends have one type; Fast DDS refuses a second one in a process."""
    for channel in context.topology.channels.values():
        # Of a type that there is not, that has been said.
        ends = [end for end in channel.ends if context.has_real_type(end.entity)]
        of_ros = context.topology.type_of_ros(channel)
        if of_ros is not None:
            yield from _compare_with_ros(context, channel, ends, of_ros)
        elif len({end.entity.type for end in ends}) > 1:
            yield from _explain_types(context, channel, ends)


def _explain_types(
    context: CheckContext, channel: Channel, ends: list[Endpoint]
) -> Iterator[Diagnostic]:
    # Among equals the type of the publisher or server counts, which comes first.
    (usual, _), *_ = Counter(end.entity.type for end in ends).most_common()
    example = next(end for end in ends if end.entity.type == usual)
    for end in ends:
        if end.entity.type != usual:
            yield context.at_value(
                context.inner(end.path, 'type'),
                'conflicting-types',
                f"{channel.kind} '{channel.name}' has two types: here {end.entity.type}, "
                f'elsewhere {usual}',
                help=f'give both ends one type, or name {with_article(channel.kind)} of its own',
                related=[context.related(example.path, f'{example} has {usual}')],
            )


def _compare_with_ros(
    context: CheckContext, channel: Channel, ends: list[Endpoint], of_ros: str
) -> Iterator[Diagnostic]:
    for end in ends:
        if end.entity.type != of_ros:
            yield context.at_value(
                context.inner(end.path, 'type'),
                'conflicting-types',
                f"{channel.kind} '{channel.name}' is one of ROS itself, with the type {of_ros}: "
                f'here it has {end.entity.type}',
                help=f'use that type, or name {with_article(channel.kind)} of its own',
            )


def check_servers(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that there is one server; which of several answers is undefined."""
    for channel in context.topology.channels.values():
        if channel.kind == 'topic':
            continue
        if channel.kind == 'service' and context.topology.is_served_by_ros(channel):
            of_ros = context.topology.type_of_ros(channel)
            for server in channel.providers:
                # Of another type, that has been said.
                if server.entity.type == of_ros:
                    yield _explain_server_of_ros(context, server)
            continue
        for server in channel.providers[1:]:
            first = channel.providers[0]
            yield context.at_key(
                server.path,
                'second-server',
                f"{channel.kind} '{channel.name}' has a server already, "
                f'in {first.owner}, and which of them answers is undefined',
                help=f'serve it once, or give this one another name with {channel.kind}:',
                related=[context.related(first.path, f'{first} serves it too')],
            )


def _explain_server_of_ros(context: CheckContext, server: Endpoint) -> Diagnostic:
    return context.at_key(
        server.path,
        'second-server',
        f"ROS itself serves '{server.written}' here, and which of them answers is undefined",
        help='give this one another name with service:',
    )
