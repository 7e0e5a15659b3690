"""What a system loses with a worker: nodes, and what others had from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from composer.language.specs import (
        DeclaredEndSpec,
        DeclaredNodeSpec,
        EndSpec,
        NodeSpec,
        SystemSpec,
    )

# The sections whose ends give something, those that take it, and what these do without it.
_GIVEN = {
    'publishers': ('subscriptions', 'gets nothing on'),
    'services': ('service_clients', 'has nobody to call at'),
    'actions': ('action_clients', 'has nobody to send goals to at'),
}
_MOST = 5


def describe_losses(spec: SystemSpec, worker: str) -> str:
    """Return in words which nodes go with a worker, and what the others do not have then."""
    gone, left = _split(spec, worker)
    names = {node.full_name for node in gone}
    nodes = 'its node is' if len(names) == 1 else f'its {len(names)} nodes are'
    text = f'{nodes} gone: {_list(sorted(names))}'
    lines = list(_describe_ends(gone, left))
    return '\n'.join([text, *(f'  {line}' for line in lines)])


def _split(
    spec: SystemSpec, worker: str
) -> tuple[list[NodeSpec], list[NodeSpec | DeclaredNodeSpec]]:
    """Return the nodes of a worker, and all others."""
    gone = [node for node in spec.nodes.values() if node.worker == worker]
    names = {node.full_name for node in gone}
    return gone, [node for node in spec.end_owners() if node.full_name not in names]


def _describe_ends(
    gone: Collection[NodeSpec], left: Collection[NodeSpec | DeclaredNodeSpec]
) -> Iterator[str]:
    for giving, (taking, lack) in _GIVEN.items():
        lost = _channels(gone, giving) - _channels(left, giving)
        for node in left:
            missed = sorted(_channels([node], taking) & lost)
            if missed:
                yield f"'{node.full_name}' {lack} {_list(missed)}"


def _channels(nodes: Collection[NodeSpec | DeclaredNodeSpec], section: str) -> set[str]:
    return {
        full_name(node, kind.channel, _channel_of(end, kind.channel))
        for node in nodes
        for kind, end in node.ends()
        if kind.section == section and kind.channel is not None
    }


def _channel_of(end: EndSpec | DeclaredEndSpec, channel: str) -> str:
    """Return the name of the topic, service or action of an end, as written."""
    return str(getattr(end, 'channel', None) or getattr(end, channel))


def _list(names: list[str]) -> str:
    shown = ', '.join(f"'{each}'" for each in names[:_MOST])
    rest = len(names) - _MOST
    return f'{shown} and {rest} more' if rest > 0 else shown
