"""Finds the node, channel or end that a finding is about, by its place in the file."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, TypeAlias

from composer.entity_kinds import BEHAVIOUR_KEYS, ENTITY_KINDS
from composer.rules import Severity, load_rule

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from composer.checks.connections.topology import Channel, Topology
    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.yaml_text.positions import DataPath, SourceMap

    Lines: TypeAlias = Mapping[tuple[SourceFile, int], list[tuple[Span, DataPath]]]

# Rules about a topic, service or action as a whole.
_OF_CHANNELS = {kind.unmatched[0] for kind in ENTITY_KINDS if kind.unmatched}
# Keys of an end that are about its node's behaviours, not about its channel.
_OF_BEHAVIOURS = BEHAVIOUR_KEYS | {'group', 'on_error', 'publish', 'with'}
# Of the paths of `nodes: {<name>: {<section>: {<entity>: …}}}`.
_NODE, _ENTITY = 2, 4


def place_findings(
    positions: SourceMap, topology: Topology, findings: Sequence[Diagnostic]
) -> dict[DataPath, tuple[int, ...]]:
    """Return the findings of each part of a system, as indices into the list of all.

    A node, a process or an end has its path as the key, a channel its kind and its name.
    """
    lines = defaultdict(list)
    for path, span in (*positions.keys.items(), *positions.values.items()):
        if path[:1] in (('nodes',), ('processes',)) and len(path) >= _NODE:
            lines[span.source, span.line].append((span, path))
    channels = {end.path: each for each in topology.channels.values() for end in each.ends}
    # The keys of a dictionary, as one finding may be at a part several times.
    places: dict[DataPath, dict[int, None]] = defaultdict(dict)
    for index, finding in enumerate(findings):
        for part in _find_parts(finding, lines, channels):
            places[part][index] = None
    return {part: tuple(indices) for part, indices in places.items()}


def _find_parts(
    finding: Diagnostic, lines: Lines, channels: Mapping[DataPath, Channel]
) -> Iterator[DataPath]:
    paths = _paths_at(finding.span, lines) if finding.span else []
    ends = {}
    for path in paths:
        end = _end_of(path)
        if end in channels and not _OF_BEHAVIOURS.intersection(path[len(end) : len(end) + 1]):
            ends[end] = channels[end]
    # Of several ends written in one place, those whose channel the finding names.
    named = {end: ends[end] for end in ends if f"'{ends[end].name}'" in finding.message}
    for end, channel in (named or ends).items():
        yield (channel.kind, channel.name) if finding.rule in _OF_CHANNELS else end
    if not ends:
        yield from (path[:_NODE] for path in paths)
    rule = load_rule(finding.rule)
    if rule.family == 'wiring' and rule.severity is Severity.ERROR:
        # It is about the other ends that it names, too.
        known = {id(channel) for channel in (named or ends).values()}
        for related in finding.related:
            partners = map(_end_of, _paths_at(related.span, lines))
            yield from (end for end in partners if id(channels.get(end)) in known)


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
