"""Topics, services and actions that have another type after an edit.

A process of Fast DDS has one type for each name: an end with the new one can be created only when
all with the old one are gone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.entity_kinds import ChannelKind
    from composer.language.specs import SystemSpec
    from composer.planning.plan import Target

    # An end, the kind and full name of what it is an end of, and its type.
    _End = tuple[Target, tuple[ChannelKind, str], str]


def find_clashing_ends(old: SystemSpec, new: SystemSpec) -> set[Target]:
    """Return the ends, of `old` and of `new`, of what has another type in the other system."""
    before, after = list(_ends(old)), list(_ends(new))

    def differing(ends: list[_End], others: list[_End]) -> set[Target]:
        types = {channel: type_name for _, channel, type_name in others}
        return {
            target
            for target, channel, type_name in ends
            if types.get(channel, type_name) != type_name
        }

    return differing(before, after) | differing(after, before)


def _ends(spec: SystemSpec) -> Iterator[_End]:
    for node in spec.nodes.values():
        for kind, end in node.ends():
            if kind.channel is not None:
                channel = (kind.channel, full_name(node, kind.channel, getattr(end, kind.channel)))
                yield (node.full_name, kind.section, end.name), channel, end.type
