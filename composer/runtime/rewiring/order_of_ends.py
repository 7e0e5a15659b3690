"""In which order nodes end: one that waits for another must not wait for what has ended."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.language.specs import NodeSpec

# What is called, and the section of a node that serves it.
_SERVING = {'service': 'services', 'action': 'actions'}


def order_ends(nodes: Iterable[NodeSpec]) -> Iterator[list[str]]:
    """Yield the full names of nodes that end, in groups: clients before their servers.

    Those that call each other in a circle are in one group.
    """
    served: dict[str, set[tuple[str, str]]] = {}
    callers: dict[tuple[str, str], set[str]] = {}
    for node in nodes:
        own = served.setdefault(node.full_name, set())
        for kind, end in node.ends():
            if kind.channel is None or kind.channel not in _SERVING:
                continue
            name = full_name(node, kind.channel, getattr(end, kind.channel))
            if kind.section == _SERVING[kind.channel]:
                own.add((kind.channel, name))
            else:
                callers.setdefault((kind.channel, name), set()).add(node.full_name)
    while served:
        free = [
            name
            for name, own in served.items()
            if all(callers.get(each, set()) <= {name} for each in own)
        ]
        group = free or list(served)
        yield group
        for name in group:
            del served[name]
        for waiting in callers.values():
            waiting.difference_update(group)
