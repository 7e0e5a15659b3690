"""Finds the node, channel or end that a finding is about, by its place in the file."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, TypeAlias

from composer.entity_kinds import BEHAVIOUR_KEYS, ENTITY_KINDS
from composer.rules import Severity, load_rule

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.checks.connections.topology import Channel, Topology
    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.entity_kinds import ChannelKind
    from composer.yaml_text.positions import DataPath, SourceMap

    ChannelKey: TypeAlias = tuple[ChannelKind, str]

# Rules about a topic, service or action as a whole.
_OF_CHANNELS = {kind.unmatched[0] for kind in ENTITY_KINDS if kind.unmatched}
# Keys of an end that are about its node's behaviours, not about its channel.
_OF_BEHAVIOURS = BEHAVIOUR_KEYS | {'group', 'on_error', 'publish', 'with'}
# Of the paths of `nodes: {<name>: {<section>: {<entity>: …}}}`.
_NODE, _ENTITY = 2, 4


class FindingPlaces:
    """The findings of each part of a system, as indices into the list of all."""

    def __init__(
        self, positions: SourceMap, topology: Topology, findings: Sequence[Diagnostic]
    ) -> None:
        self._lines: dict[tuple[SourceFile, int], list[tuple[Span, DataPath]]] = defaultdict(list)
        for spans in (positions.keys, positions.values):
            for path, span in spans.items():
                if path[:1] in (('nodes',), ('processes',)) and len(path) >= _NODE:
                    self._lines[span.source, span.line].append((span, path))
        self._channel_of_end: dict[DataPath, Channel] = {
            end.path: channel for channel in topology.channels.values() for end in channel.ends
        }
        # The keys of a dictionary, as one finding may be at a part several times.
        self._places: dict[DataPath | ChannelKey, dict[int, None]] = defaultdict(dict)
        for index, finding in enumerate(findings):
            for part in self._find_parts(finding):
                self._places[part][index] = None

    def of(self, part: DataPath | ChannelKey) -> tuple[int, ...]:
        """Return the findings of a node, a process or an end by its path, or of a channel."""
        return tuple(self._places.get(part, ()))

    def _find_parts(self, finding: Diagnostic) -> Iterator[DataPath | ChannelKey]:
        paths = self._paths_at(finding.span) if finding.span else []
        ends = [_end_of(path) for path in paths if self._is_end(path)]
        # Of several ends written in one place, those whose channel the finding names.
        named = [end for end in ends if f"'{self._channel_of_end[end].name}'" in finding.message]
        channels = {end: self._channel_of_end[end] for end in named or ends}
        for end, channel in channels.items():
            yield (channel.kind, channel.name) if finding.rule in _OF_CHANNELS else end
        if not ends:
            yield from (path[:_NODE] for path in paths)
        rule = load_rule(finding.rule)
        if rule.family == 'wiring' and rule.severity is Severity.ERROR:
            # It is about the other ends that it names, too.
            known = {id(channel) for channel in channels.values()}
            for related in finding.related:
                partners = map(_end_of, self._paths_at(related.span))
                yield from (end for end in partners if id(self._channel_of_end.get(end)) in known)

    def _is_end(self, path: DataPath) -> bool:
        end = _end_of(path)
        inner = path[len(end) : len(end) + 1]
        return end in self._channel_of_end and not _OF_BEHAVIOURS.intersection(inner)

    def _paths_at(self, place: Span) -> list[DataPath]:
        """Return the paths of the innermost values at a place: by an alias, these are several."""
        covering = [
            path
            for span, path in self._lines.get((place.source, place.line), ())
            if span.column <= place.column < span.column + max(span.length, 1)
        ]
        deepest = max(map(len, covering), default=0)
        return list(dict.fromkeys(path for path in covering if len(path) == deepest))


def _end_of(path: DataPath) -> DataPath:
    """Return the part of a path that an end would have; a process may have several nodes."""
    inner = path[_NODE : _NODE + 1] if path[:1] == ('processes',) else ()
    return path[: _ENTITY + 2 if inner in (('nodes',), ('components',)) else _ENTITY]
