"""What a page shows of a drawn system: the drawing, and facts, text and findings of each part."""

from __future__ import annotations

import re
import threading
from collections import defaultdict
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.application.file_selection import load_given
from composer.checks.absent_packages import AbsentPackages
from composer.checks.checker import check_in_context, create_context
from composer.diagnostics import describe_finding, relative_path
from composer.drawing.excerpts import Excerpts
from composer.drawing.graphviz import render_svg
from composer.drawing.picture import build_picture
from composer.drawing.shapes import arrange_shapes, count_kinds
from composer.entity_kinds import CHANNEL_KINDS
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.bindings import node_bindings
from composer.python_source.modules import ModuleSource

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from composer.checks.context import CheckContext
    from composer.drawing.excerpts import Excerpt
    from composer.drawing.picture import Edge, Picture, Side
    from composer.drawing.shapes import Arrangement, Region
    from composer.language.specs import BehaviourSpec

_OPENING = re.compile(r'.*?<svg[^>]*?viewBox="([^"]*)"[^>]*>', re.DOTALL)
# A drawing of more nodes is not tried both ways: it takes seconds.
_MOST_NODES_TRIED = 150
# Of a topic with many ends, the lines of the first ones.
_MOST_ENDS = 6
_MOST_CODE_LINES = 15
# What is left for the drawing in a window of 1440 by 900.
_STAGE = 680, 850
_MOST_FOLDED = 16


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
        raise ComposerError('; '.join(texts) or f"'{paths[0]}' cannot be read")
    return Drawing(build_picture(context, findings), _list_code(context))


def _list_code(context: CheckContext) -> dict[str, list[dict[str, Any]]]:
    """Return the behaviours of each node with the lines of their functions, by its full name."""
    return {
        node.full_name: [
            {'what': binding.owner, **place}
            for binding in node_bindings(node)
            if (place := _find_code(context, binding.behaviour))
        ]
        for node in context.spec.nodes.values()
    }


def _find_code(context: CheckContext, behaviour: BehaviourSpec) -> dict[str, Any] | None:
    module = context.modules.find(behaviour.module) if behaviour.module else None
    if not isinstance(module, ModuleSource) or module.path is None:
        return None
    function = module.functions.get(behaviour.function)
    found = (function.definition or function.class_definition) if function else None
    if found is None or not context.modules.is_of_project(behaviour.module):
        return None
    last = min(found.end_lineno or found.lineno, found.lineno + _MOST_CODE_LINES - 1)
    lines = module.lines[found.lineno - 1 : last]
    return {'file': relative_path(str(module.path)), 'first': found.lineno, 'lines': lines}


class Drawing:
    """A system as it is drawn, as a whole and with folded boxes.

    Args:
        code: The behaviours of each node, by its full name, with the lines of their functions.
        direction: `LR` or `TB`; empty for the one that is read with less zooming.

    Attributes:
        shown: What the page takes: the SVG, and the parts by their tokens; nothing is folded.
        name: Of the system.
        nodes: The full names of the nodes.
        topics: Those of the topics.
        topic_of_ends: The topic of each publisher and subscription, by the ids of these.

    Raises:
        ComposerError: Graphviz is missing or failed.
    """

    def __init__(
        self,
        picture: Picture,
        code: Mapping[str, list[dict[str, Any]]] | None = None,
        direction: str = '',
    ) -> None:
        self._picture, self._code = picture, code or {}
        tried = ['LR', 'TB'] if len(picture.nodes) <= _MOST_NODES_TRIED else ['LR']
        self._directions = [direction] if direction else tried
        self.name = picture.name
        self.nodes = {part.id[5:] for part in picture.nodes if part.kind == 'node'}
        self.topics = [part.id[6:] for part in picture.channels if part.kind == 'topic']
        self.topic_of_ends = {edge.id: edge.channel for edge in picture.edges}
        self._lock = threading.Lock()
        self._fold = lru_cache(_MOST_FOLDED)(self._describe)
        self.shown = self._describe(frozenset())

    def fold(self, folded: Collection[str]) -> dict[str, Any]:
        """Return it with these boxes folded; one at a time, and the last ones are kept."""
        parts = self.shown['parts'].values()
        key = frozenset(part['id'] for part in parts if 'members' in part).intersection(folded)
        with self._lock:
            return self._fold(key) if key else self.shown

    def with_outside(self, outside: Mapping[str, list[dict[str, str]]]) -> Drawing:
        """Return it with the ends outside of topics, too, laid out in the same direction."""
        sides: dict[str, Side] = {'publisher': 'providers', 'subscription': 'users'}
        channels = []
        for channel in self._picture.channels:
            ends = outside.get(channel.name, ()) if channel.kind == 'topic' else ()
            shown = dict.fromkeys((*channel.external, *(sides[end['kind']] for end in ends)))
            channels.append(replace(channel, external=tuple(shown)))
        picture = replace(self._picture, channels=tuple(channels))
        return Drawing(picture, self._code, self._directions[0])

    def _describe(self, folded: frozenset[str]) -> dict[str, Any]:
        documents = {
            each: _inlined(render_svg(self._picture, folded, each)) for each in self._directions
        }
        self._directions = [min(documents, key=lambda each: _shrinkage(documents[each]))]
        drawn = arrange_shapes(self._picture, folded)
        return {
            'svg': documents[self._directions[0]],
            'code': self._code,
            'folder': str(Path.cwd()),
            'stands_in': drawn.stands_in,
            **_describe(self._picture, drawn),
        }


def _inlined(document: str) -> str:
    """Return an SVG document as one element, of the size of its place."""
    opening = r'<svg xmlns="http://www.w3.org/2000/svg" viewBox="\1" role="group">'
    return _OPENING.sub(opening, document, count=1).rstrip()


def _shrinkage(document: str) -> float:
    *_, width, height = map(float, document.split('"', 4)[3].split())
    return max(width / _STAGE[0], height / _STAGE[1])


def _describe(picture: Picture, drawn: Arrangement) -> dict[str, Any]:
    parts = dict(_parts(picture))
    parts |= {region.token: _box(region, drawn, parts) for region in drawn.regions}
    parts |= dict(_bundles(drawn, parts))
    owners: dict[int, str] = {}
    for token, part in parts.items():
        for index in part['findings']:
            owners.setdefault(index, token)
    findings = [
        {**describe_finding(finding), 'part': owners.get(index)}
        for index, finding in enumerate(picture.findings)
    ]
    return {'parts': parts, 'findings': findings}


def _parts(picture: Picture) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the data of each node, channel and edge, by its token."""
    tokens, excerpts = picture.tokens(), Excerpts(picture.positions)
    ends: dict[str, list[Edge]] = defaultdict(list)
    for edge in picture.edges:
        ends[edge.node].append(edge)
        ends[edge.channel].append(edge)
    for box in (*picture.nodes, *picture.channels):
        # Of a channel, the lines of its ends.
        declared = ends[box.id][:_MOST_ENDS] if box.types else [box]
        near = [tokens[edge.id] for edge in ends[box.id]]
        name, facts = box.title.partition(' ')[2], box.facts
        for side in box.external:
            provides = side == 'providers'
            kinds = (kind for kind in CHANNEL_KINDS if kind.channel == box.kind)
            facts += [f'external {kind.noun}s' for kind in kinds if kind.provides == provides]
        lines = dict.fromkeys(lines for part in declared for lines in excerpts.of(part.path))
        yield tokens[box.id], _part(box.id, box.kind, name, facts, box.findings, near, lines)
    names = {node.id: node.name for node in picture.nodes}
    for edge in picture.edges:
        qos = edge.policies and f'QoS: {edge.policies}'
        delivery = edge.delivery.way and f'delivery: {edge.delivery}'
        facts = [*filter(None, (edge.type, qos, delivery, edge.followed))]
        name = f'{edge.name} of {names[edge.node]}'
        near = [tokens[edge.node], tokens[edge.channel]]
        part = _part(edge.id, edge.role, name, facts, edge.findings, near, excerpts.of(edge.path))
        yield tokens[edge.id], {**part, 'leaves_node': edge.begins_at_node}


def _box(region: Region, drawn: Arrangement, parts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data of a region; `near` are the ends in it of what crosses its border."""
    members = {shape.token: shape.kind for shape in region.all_shapes()}
    near = [
        token
        for token, part in parts.items()
        if token[0] == 'e' and len(members.keys() & set(part['near'])) == 1
    ]
    name = region.title.removeprefix(f'{region.kind} ')
    facts = [', '.join(count_kinds(members.values()))]
    return {
        **_part(region.id, region.kind, name, facts, (), near),
        'folded': region.id in {shape.id for shape in drawn.root.all_shapes()},
        'members': list(members),
    }


def _bundles(drawn: Arrangement, parts: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the data of each line that stands for several."""
    for line in drawn.lines:
        near = [part for part, by in drawn.stands_in.items() if by == line.token and part in parts]
        if near:
            start, end = (parts[token] for token in (line.start, line.end))
            id_, name = f'lines:{start["id"]}>{end["id"]}', f'{start["name"]} to {end["name"]}'
            yield line.token, _part(id_, 'connections', name, line.details, (), near)


def _part(
    id_: str,
    kind: str,
    name: str,
    facts: Sequence[str],
    findings: Sequence[int],
    near: Sequence[str],
    excerpts: Iterable[Excerpt] = (),
) -> dict[str, Any]:
    return {
        'id': id_,
        'kind': kind,
        'name': name,
        'facts': facts,
        'findings': findings,
        'near': near,
        'excerpts': [asdict(each) for each in excerpts],
    }
