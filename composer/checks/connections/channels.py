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
        if len({end.entity.type for end in ends}) > 1:
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


def check_servers(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that there is one server; which of several answers is undefined."""
    for channel in context.topology.channels.values():
        if channel.kind == 'topic':
            continue
        for server in channel.providers[1:]:
            first = channel.providers[0]
            yield context.at_key(
                server.path,
                'second-server',
                f"{channel.kind} '{channel.name}' has a server already, "
                f"in node '{first.node.name}', and which of them answers is undefined",
                help=f'serve it once, or give this one another name with {channel.kind}:',
                related=[context.related(first.path, f'{first} serves it too')],
            )
