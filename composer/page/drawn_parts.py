"""What a page shows of a drawn system: the drawing, and facts, text and findings of each part."""

from __future__ import annotations

import re
import threading
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

from composer.application.file_selection import load_given
from composer.checks.absent_packages import AbsentPackages
from composer.checks.checker import check_in_context, create_context
from composer.confidential import may_show_lines
from composer.diagnostics import describe_finding, relative_path
from composer.drawing.graphviz import render_svg
from composer.drawing.picture import Box, Edge, build_picture
from composer.drawing.shapes import arrange, count_kinds
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.modules import ModuleSource

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.drawing.picture import Part, Picture, Side
    from composer.drawing.shapes import Arrangement, Region
    from composer.language.specs import BehaviourSpec
    from composer.yaml_text.positions import DataPath, SourceMap

_OPENING = re.compile(r'.*?<svg[^>]*?viewBox="([^"]*)"[^>]*>', re.DOTALL)
# A drawing of more nodes is not tried both ways: it takes seconds.
_MOST_NODES_TRIED = 150
# Of a topic with many ends, the lines of the first ones.
_MOST_ENDS = 6
_MOST_CODE_LINES = 15
# The depth of `nodes: {<name>: …}`; every part lies below such an entry.
_NODE = 2
# What is left for the drawing in a window of 1440 by 900.
_STAGE = 750, 850
_MOST_FOLDED = 16
# More boxes are not read at once.
_MOST_SEEN = 100


class Excerpt(NamedTuple):
    """Successive lines of a file.

    Attributes:
        file: The path as reports show it, or the `--set` option without its value.
        first: The number of the first line, counted from 1.
        what: What the lines are of, as a timer's function; empty for a part itself.
    """

    file: str
    first: int
    lines: tuple[str, ...]
    what: str = ''


def draw_files(paths: Sequence[Path], words: Sequence[str], set_values: Sequence[str]) -> Drawing:
    """Return the drawing of a system with its findings.

    Raises:
        ComposerError: The files cannot be read, or there is no Graphviz.
    """
    system = load_given(paths, words, set_values, is_shown=True)
    context = create_context(system, InterfaceCatalogue())
    findings = AbsentPackages().leave_out(check_in_context(system, context))
    if context is None:
        texts = [f'{each.span or each.file}: {each.message}' for each in findings]
        raise ComposerError('; '.join(texts))
    return Drawing(context, findings)


def _list_rates(context: CheckContext) -> dict[str, float]:
    """Return how often timers are called, in Hz, by their ids, but those that may take longer."""
    return {
        f'timer:{node.full_name}:{timer.name}': 1 / timer.period_sec
        for node in context.spec.nodes.values()
        for timer in node.timers.values()
        if not timer.by_parameter
        and (timer.behaviour is None or _find_kind(context, timer.behaviour) is FunctionKind.PLAIN)
    }


def _find_kind(context: CheckContext, behaviour: BehaviourSpec) -> FunctionKind | None:
    function = context.modules.find_function(behaviour.module, behaviour.function)
    return function.kind if function else None


def _list_code(context: CheckContext) -> dict[str, list[Excerpt]]:
    """Return the lines of the functions of each node, by its id."""
    modules, code = context.modules, defaultdict(list)
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            name = binding.behaviour.module
            module = modules.find(name)
            function = modules.find_function(name, binding.behaviour.function)
            found = function and (function.definition or function.class_definition)
            if found and isinstance(module, ModuleSource) and modules.is_of_project(name):
                lines = module.lines[found.lineno - 1 : found.end_lineno][:_MOST_CODE_LINES]
                excerpt = Excerpt(module.source.name, found.lineno, lines, binding.owner)
                code[f'node:{node.full_name}'].append(excerpt)
    return code


class Drawing:
    """A system as it is drawn, as a whole and with folded boxes.

    Attributes:
        nodes: The full names of the nodes.
        topics: Those of the topics.
        topic_of_ends: The topic of each publisher and subscription, by the ids of these.
        rates: How often timers are called, in Hz, by their ids.

    Raises:
        ComposerError: Graphviz is missing or failed.
    """

    def __init__(self, context: CheckContext, findings: Sequence[Diagnostic]) -> None:
        self._picture = picture = build_picture(context, findings)
        self._declared, self._code = picture.channels, _list_code(context)
        self._first = _fold_many(picture)
        # The one that is read with less zooming stays.
        is_tried = self._first or len(picture.nodes) <= _MOST_NODES_TRIED
        self._directions = ['LR', 'TB'] if is_tried else ['LR']
        self.name = picture.name
        self.nodes = {part.id[5:] for part in picture.nodes if part.kind == 'node'}
        self.topics = [part.id[6:] for part in picture.channels if part.kind == 'topic']
        self.rates = _list_rates(context)
        self.topic_of_ends = {edge.id: edge.channel.id for edge in picture.edges}
        self._lock = threading.Lock()
        self._fold = lru_cache(_MOST_FOLDED)(self._describe)
        self.fold()

    def fold(self, folded: Collection[str] | None = None) -> dict[str, Any]:
        """Return what the page takes: the SVG, and the parts by their tokens.

        Args:
            folded: The ids of the boxes that are folded; `None` for as many as it takes to read
                the rest. The last drawings are kept.
        """
        with self._lock:
            return self._fold(frozenset(self._first if folded is None else folded))

    def show_outside(self, outside: Mapping[str, list[dict[str, str]]]) -> None:
        """Draw the ends outside of topics from now on, besides those that the files declare.

        Args:
            outside: See `find_outside`.
        """
        sides: dict[str, Side] = {'publisher': 'providers', 'subscription': 'users'}
        channels = []
        for channel in self._declared:
            ends = outside.get(channel.name, ()) if channel.kind == 'topic' else ()
            external = {*channel.external, *(sides[end['kind']] for end in ends)}
            channels.append(replace(channel, external=tuple(sorted(external))))
        with self._lock:
            self._picture = replace(self._picture, channels=tuple(channels))
            self._fold.cache_clear()

    def _describe(self, folded: frozenset[str]) -> dict[str, Any]:
        drawn = arrange(self._picture, folded)
        with ThreadPoolExecutor() as pool:
            # Graphviz has another process for each, and takes as long as the rest.
            layouts = pool.map(partial(render_svg, drawn), self._directions)
            parts = dict(_parts(self._picture, self._code))
            parts |= {region.token: _box(region, drawn, parts) for region in drawn.regions}
            parts |= dict(_bundles(drawn, parts))
        documents = dict(zip(self._directions, map(_inlined, layouts), strict=True))
        self._directions = [min(documents, key=lambda each: _shrinkage(documents[each]))]
        owners = {index: token for token in reversed(parts) for index in parts[token]['findings']}
        findings = [
            {**describe_finding(finding), 'part': owners.get(index)}
            for index, finding in enumerate(self._picture.findings)
        ]
        return {
            'svg': documents[self._directions[0]],
            'stands_in': drawn.stands_in,
            'parts': parts,
            'findings': findings,
        }


def _fold_many(picture: Picture) -> set[str]:
    """Return the boxes to fold so that not too many are seen, the outer ones unfolded first."""
    drawn = arrange(picture)
    folded = {region.id for region in drawn.root.inner}
    seen = len(drawn.root.boxes) + len(folded)
    for region in drawn.regions:
        more = len(region.boxes) + len(region.inner) - 1
        if region.id in folded and seen + more <= _MOST_SEEN:
            folded.remove(region.id)
            folded.update(each.id for each in region.inner)
            seen += more
    return folded


def _inlined(document: str) -> str:
    """Return an SVG document as one element, of the size of its place."""
    opening = r'<svg xmlns="http://www.w3.org/2000/svg" viewBox="\1" role="group">'
    return _OPENING.sub(opening, document, count=1).rstrip()


def _shrinkage(document: str) -> float:
    *_, width, height = map(float, document.split('"', 4)[3].split())
    return max(width / _STAGE[0], height / _STAGE[1])


def _parts(
    picture: Picture, code: Mapping[str, list[Excerpt]]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the data of each node, channel and edge, by its token."""
    excerpts = Excerpts(picture.positions)
    edges: dict[str, list[Part]] = defaultdict(list)
    for edge in picture.edges:
        for box in (edge.start, edge.end):
            edges[box.token].append(edge)
    for part in picture.parts:
        kind, near = part.kind, edges[part.token]
        outside = part.outside if isinstance(part, Box) else []
        if isinstance(part, Edge):
            kind, near = part.role, [part.start, part.end]
        # Of a channel, the lines of its ends.
        declared = near[:_MOST_ENDS] if isinstance(part, Box) and part.details else [part]
        lines = dict.fromkeys(lines for each in declared for lines in excerpts.of(each.path))
        about = _part(part.id, kind, part.title, part.facts, [each.token for each in near])
        yield (
            part.token,
            {
                **about,
                'outside': [token for each in outside for token in (each.token, each.node.token)],
                'findings': part.findings,
                'excerpts': [each._asdict() for each in (*lines, *code.get(part.id, ()))],
            },
        )


def _box(region: Region, drawn: Arrangement, parts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data of a region; `near` are the ends in it of what crosses its border."""
    members = {box.token: box.kind for box in region.all_boxes()}
    ends = dict.fromkeys(end for each in members if each in parts for end in parts[each]['near'])
    near = [end for end in ends if len(members.keys() & set(parts[end]['near'])) == 1]
    facts = [', '.join(count_kinds(members.values()))]
    return {
        **_part(region.id, region.kind, region.name, facts, near),
        'folded': region.is_folded and region.token not in drawn.stands_in,
        'members': list(members),
    }


def _bundles(drawn: Arrangement, parts: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the data of each line that stands for several, and is no topic."""
    behind = defaultdict(list)
    for part, by in drawn.stands_in.items():
        if part in parts:
            behind[by].append(part)
    for line in drawn.lines:
        if (near := behind[line.token]) and line.token not in parts:
            # The ends outside are no parts.
            boxes = (line.start, line.end)
            start, end = (
                parts.get(box.token, {'id': box.name, 'name': box.name}) for box in boxes
            )
            id_, name = f'lines:{start["id"]}>{end["id"]}', f'{start["name"]} to {end["name"]}'
            yield line.token, _part(id_, 'connections', name, line.details, near)


def _part(
    id_: str, kind: str, title: str, facts: Sequence[str], near: Sequence[str]
) -> dict[str, Any]:
    name = title.removeprefix(f'{kind} ')
    about = {'id': id_, 'kind': kind, 'name': name, 'facts': facts, 'near': near}
    return {**about, 'findings': (), 'excerpts': ()}


class Excerpts:
    """Finds the lines of entries; environment variables of processes are left out."""

    def __init__(self, positions: SourceMap) -> None:
        self._positions = positions
        self._spans: dict[DataPath, list[tuple[DataPath, Span]]] = defaultdict(list)
        # The column from which a line is left out.
        self._ends: dict[tuple[SourceFile, int], int] = {}
        for path, span in (*positions.keys.items(), *positions.values.items()):
            self._spans[path[:_NODE]].append((path, span))
            if path[:1] == ('processes',) and path[_NODE : _NODE + 1] == ('env',):
                for number in range(span.line, _last_line(span) + 1):
                    column = span.column if number == span.line else 1
                    before = self._ends.get((span.source, number), column)
                    self._ends[span.source, number] = min(column, before)

    def of(self, path: DataPath) -> list[Excerpt]:
        """Return the lines of an entry: those below its key, then those of other files."""
        key = self._positions.key(path)
        numbers = defaultdict(list, {key.source: [key.line, _last_line(key)]})
        for at, span in self._spans[path[:_NODE]]:
            if at[: len(path)] == path and span.source is not key.source:
                numbers[span.source].append(span.line)
        return [
            self._excerpt(source, min(lines), max(lines))
            for source, lines in numbers.items()
            if may_show_lines(source.name)
        ]

    def _excerpt(self, source: SourceFile, first: int, last: int) -> Excerpt:
        is_file = source.home is None
        name = relative_path(source.name) if is_file else source.name.partition('=')[0]
        lines = []
        for number in range(first, last + 1):
            end = self._ends.get((source, number))
            line = source.line(number)
            lines.append(line if end is None else f'{line[: end - 1]}…')
        return Excerpt(name, first, tuple(lines))


def _last_line(key: Span) -> int:
    """Return the last line of an entry: all lines that are indented below its key."""
    last = key.line
    for number, line in enumerate(key.source.lines[key.line :], key.line + 1):
        if line.strip():
            if len(line) - len(line.lstrip(' ')) < key.column:
                break
            last = number
    return last
