"""Marks the node, channel or end that a finding is about; its place in the file tells which."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.entity_kinds import BEHAVIOUR_KEYS, ENTITY_KINDS
from composer.rules import Severity, load_rule
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from composer.checks.connections.topology import Topology
    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.yaml_text.positions import DataPath, SourceMap

    Lines: TypeAlias = Mapping[tuple[SourceFile, int], list[tuple[Span, DataPath]]]

# Rules about a topic, service or action as a whole.
_OF_CHANNELS = {kind.unmatched[0] for kind in ENTITY_KINDS if kind.unmatched}
# Keys of an end that are about its node's behaviours, not about its channel.
_OF_BEHAVIOURS = BEHAVIOUR_KEYS | {'group', 'on_error', 'publish', 'with'}
# Of the paths of `nodes: {<name>: {<section>: {<entity>: …}}}`.
_NODE, _ENTITY = 2, 4
_REMARK_WIDTH = 44
# Of a part with more findings, the rest is counted.
_MOST_REMARKS = 2


class Marks:
    """The findings of each part of a system, given out in the order in which parts are drawn."""

    def __init__(
        self, positions: SourceMap, topology: Topology, findings: Sequence[Diagnostic]
    ) -> None:
        self._findings = findings
        self._told: set[int] = set()
        self._places: dict[DataPath, list[int]] = defaultdict(list)
        lines = defaultdict(list)
        for path, span in (*positions.keys.items(), *positions.values.items()):
            if path[:1] in (('nodes',), ('processes',)) and len(path) >= _NODE:
                lines[span.source, span.line].append((span, path))
        channels = {end.path: key for key, each in topology.channels.items() for end in each.ends}
        for index, finding in enumerate(findings):
            # One finding may be at a part several times.
            for part in dict.fromkeys(_find_parts(finding, lines, channels)):
                self._places[part].append(index)

    def at(self, key: DataPath) -> dict[str, Any]:
        """Return `findings`, `remarks` and `mark` of a part: a message is only shown once.

        Args:
            key: The path of a node, a process or an end; the kind and the name of a channel.
        """
        indices = tuple(self._places.get(key, ()))
        fresh = [self._findings[index] for index in indices if index not in self._told]
        self._told.update(indices)
        remarks = [
            line
            for finding in fresh[:_MOST_REMARKS]
            for line in textwrap.wrap(
                f'{finding.severity.value}: {escape(finding.message)}', _REMARK_WIDTH
            )
        ]
        if (rest := len(fresh) - _MOST_REMARKS) > 0:
            remarks.append(f'and {rest} more')
        # `error` is before `warning`.
        mark = min((self._findings[index].severity.value for index in indices), default='')
        return {'findings': indices, 'remarks': tuple(remarks), 'mark': mark}


def _find_parts(
    finding: Diagnostic, lines: Lines, channels: Mapping[DataPath, tuple[str, str]]
) -> Iterator[DataPath]:
    """Yield what `Marks.at` takes; `channels` are the kind and name of that of each end."""
    paths = _paths_at(finding.span, lines) if finding.span else []
    ends = {
        end: channels[end]
        for path in paths
        if (end := _end_of(path)) in channels
        and _OF_BEHAVIOURS.isdisjoint(path[len(end) : len(end) + 1])
    }
    if not ends:
        yield from (path[:_NODE] for path in paths)
    # Of several ends written in one place, those whose channel the finding names.
    named = {end: key for end, key in ends.items() if f"'{key[1]}'" in finding.message} or ends
    for end, key in named.items():
        yield key if finding.rule in _OF_CHANNELS else end
    rule = load_rule(finding.rule)
    if rule.family == 'wiring' and rule.severity is Severity.ERROR:
        # It is about the other ends that it names, too.
        for related in finding.related:
            partners = map(_end_of, _paths_at(related.span, lines))
            yield from (end for end in partners if channels.get(end) in named.values())


def _paths_at(place: Span, lines: Lines) -> list[DataPath]:
    """Return the paths of the innermost values at a place: by an alias, these are several."""
    covering = [
        path
        for span, path in lines.get((place.source, place.line), ())
        if span.column <= place.column < span.column + max(span.length, 1)
    ]
    deepest = max(map(len, covering), default=0)
    return list(dict.fromkeys(path for path in covering if len(path) == deepest))


def _end_of(path: DataPath) -> DataPath:
    """Return the part of a path that an end would have; a process may have several nodes."""
    inner = path[_NODE : _NODE + 1] if path[:1] == ('processes',) else ()
    return path[: _ENTITY + 2 if inner in (('nodes',), ('components',)) else _ENTITY]
