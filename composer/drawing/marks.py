"""Which node, topic or end of a topic a finding is about, told by where it was written."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, TypeAlias

from composer.rules import Severity, load_rule

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.checks.connections.topology import Channel, ChannelKind, Graph
    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.yaml_text.positions import DataPath, SourceMap

    HubKey: TypeAlias = tuple[ChannelKind, str]

# What is said of a topic, service or action as a whole.
_OF_HUBS = {'no-publisher', 'no-subscription', 'no-server'}
# What an end says of its node's behaviours, not of what it is tied to.
_OF_BEHAVIOURS = {
    'accept',
    'behaviour',
    'feedback',
    'group',
    'on_error',
    'publish',
    'result',
    'with',
}
# Of the paths of `nodes: {<name>: {<section>: {<entity>: …}}}`.
_BOX, _ENTITY = 2, 4


class Marks:
    """The findings of each part of a system, as indices."""

    def __init__(self, positions: SourceMap, graph: Graph, findings: Sequence[Diagnostic]) -> None:
        self._paths = _PathFinder(positions)
        self._channels: dict[DataPath, Channel] = {
            end.path: channel for channel in graph.channels.values() for end in channel.ends
        }
        self._boxes: dict[DataPath, list[int]] = defaultdict(list)
        self._edges: dict[DataPath, list[int]] = defaultdict(list)
        self._hubs: dict[HubKey, list[int]] = defaultdict(list)
        for index, finding in enumerate(findings):
            self._place(index, finding)

    def of_box(self, path: DataPath) -> tuple[int, ...]:
        """Return the findings of the node or process at a path."""
        return _unique(self._boxes.get(path, []))

    def of_edge(self, path: DataPath) -> tuple[int, ...]:
        """Return the findings of the publisher or the like at a path."""
        return _unique(self._edges.get(path, []))

    def of_hub(self, key: HubKey) -> tuple[int, ...]:
        """Return the findings of a topic, service or action."""
        return _unique(self._hubs.get(key, []))

    def _place(self, index: int, finding: Diagnostic) -> None:
        paths = self._paths.at(finding.span) if finding.span else []
        ends = [path[:_ENTITY] for path in paths if self._is_end(path)]
        ends = self._named_by(finding, ends)
        for end in ends:
            if finding.rule in _OF_HUBS:
                channel = self._channels[end]
                self._hubs[channel.kind, channel.name].append(index)
            else:
                self._edges[end].append(index)
        rule = load_rule(finding.rule)
        if rule.family == 'wiring' and rule.severity is Severity.ERROR:
            self._place_partners(index, finding, ends)
        if not ends:
            for path in paths:
                self._boxes[path[:_BOX]].append(index)

    def _place_partners(self, index: int, finding: Diagnostic, ends: Sequence[DataPath]) -> None:
        """Mark the other ends that a finding on wiring speaks of."""
        channels = {id(self._channels[end]) for end in ends}
        for related in finding.related:
            for path in self._paths.at(related.span):
                partner = path[:_ENTITY]
                if id(self._channels.get(partner)) in channels:
                    self._edges[partner].append(index)

    def _is_end(self, path: DataPath) -> bool:
        inner = path[_ENTITY : _ENTITY + 1]
        return path[:_ENTITY] in self._channels and not _OF_BEHAVIOURS.intersection(inner)

    def _named_by(self, finding: Diagnostic, ends: list[DataPath]) -> list[DataPath]:
        """Return those of several ends, written in one place, whose channel a finding names."""
        named = [end for end in ends if f"'{self._channels[end].name}'" in finding.message]
        return named or ends


class _PathFinder:
    """Finds what is written at a place; repeated or aliased text is several things."""

    def __init__(self, positions: SourceMap) -> None:
        self._lines: dict[tuple[SourceFile, int], list[tuple[Span, DataPath]]] = defaultdict(list)
        for spans in (positions.keys, positions.values):
            for path, span in spans.items():
                if path[:1] in (('nodes',), ('processes',)) and len(path) >= _BOX:
                    self._lines[span.source, span.line].append((span, path))

    def at(self, place: Span) -> list[DataPath]:
        """Return the paths of the innermost things at a place."""
        covering = list(self._covering(place))
        deepest = max((len(path) for path in covering), default=0)
        return list(dict.fromkeys(path for path in covering if len(path) == deepest))

    def _covering(self, place: Span) -> Iterator[DataPath]:
        for span, path in self._lines.get((place.source, place.line), ()):
            if span.column <= place.column < span.column + max(span.length, 1):
                yield path


def _unique(indices: list[int]) -> tuple[int, ...]:
    return tuple(dict.fromkeys(indices))
