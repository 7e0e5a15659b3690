"""A picture → shapes in nested regions, and lines between them: what mermaid and dot write.

Shapes have short tokens instead of names: no name can clash with a keyword of a language.
"""

from __future__ import annotations

import textwrap
from collections import Counter, defaultdict
from dataclasses import field, replace
from typing import TYPE_CHECKING

from composer.drawing.delivery import OUTSIDE
from composer.drawing.picture import sends
from composer.names import count_of
from composer.records import record
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from composer.drawing.picture import Box, Edge, Picture

_REMARK_WIDTH = 44
# Of a part with more findings, the rest is counted.
_MOST_REMARKS = 2


@record
class Shape:
    """A node, process or channel as it is drawn; all of its texts are printable.

    Attributes:
        kind: `node`, `process`, `topic`, `service`, `action` or `external`; of a folded region,
            `folded`.
        title: Empty for a line.
        details: Smaller lines below the title.
        remarks: The messages of its findings, in lines.
        mark: The worst of its findings, `error` or `warning`; empty if it has none.
    """

    token: str
    kind: str
    title: str = ''
    details: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    mark: str = ''


@record
class Line(Shape):
    """An arrow between two shapes, with its details beside it.

    Its `kind` may be `wait`, too.

    Attributes:
        role: The kind of the end of a node, as in `publisher`; empty for others.
    """

    start: str = ''
    end: str = ''
    role: str = ''


@record
class Region:
    """A namespace, a host or a worker, with the shapes in it that are in no deeper region.

    Attributes:
        id: The keys of all regions down to it, as in `box:/worker camera/left`.
        kind: `namespace`, `host` or `worker`.
        title: Its printable name; a namespace in full.
        is_folded: Whether one shape is drawn for all of it.
    """

    token: str = ''
    id: str = 'box:'
    kind: str = 'namespace'
    title: str = '/'
    is_folded: bool = False
    shapes: list[Shape] = field(default_factory=list)
    inner: list[Region] = field(default_factory=list)

    def all_shapes(self) -> list[Shape]:
        """Return the shapes in it and in all regions below."""
        return [*self.shapes, *(shape for each in self.inner for shape in each.all_shapes())]

    def as_shape(self) -> Shape:
        """Return what is drawn for all of it when it is folded."""
        hidden = self.all_shapes()
        details = count_kinds(shape.kind for shape in hidden)
        return Shape(self.token, 'folded', self.title, details, mark=_worst(hidden))


@record
class Arrangement:
    """All shapes and lines; shapes without a namespace are in `root` itself.

    Attributes:
        regions: All regions, each before those in it.
        stands_in: The token of what is drawn for each shape, line and region that is in a folded
            region, and for each line that is drawn with others as one.
    """

    root: Region
    lines: tuple[Line, ...]
    regions: tuple[Region, ...]
    stands_in: dict[str, str]


def arrange_shapes(picture: Picture, folded: Collection[str] = ()) -> Arrangement:
    """Return the shapes and lines of a picture.

    Args:
        folded: The ids of regions that are drawn as one shape.
    """
    tokens, marks = picture.tokens(), _marks(picture)
    root, regions = Region(), dict[str, Region]()
    for box in (*picture.nodes, *picture.channels):
        region = root
        for kind, key, title in _list_regions(box):
            id_ = f'{region.id}/{key}'
            if id_ not in regions:
                token = f'g{len(regions)}'
                regions[id_] = Region(token, id_, kind, escape(title), id_ in folded)
                region.inner.append(regions[id_])
            region = regions[id_]
        details = tuple(map(escape, box.types))
        shape = Shape(tokens[box.id], box.kind, escape(box.name), details, *marks[box.id])
        region.shapes.append(shape)
    lines = [_line(edge, tokens, *marks[edge.id]) for edge in picture.edges]
    for channel in picture.channels:
        for side in channel.external:
            token = f'x{tokens[channel.id]}{side[0]}'
            root.shapes.append(Shape(token, 'external', 'external'))
            ends = [token, tokens[channel.id]]
            if not sends(channel.kind, provides=side == 'providers'):
                ends.reverse()
            lines.append(Line(f'{token}l', 'external', start=ends[0], end=ends[1]))
    for index, wait in enumerate(picture.waits):
        start, end = tokens[wait.target], tokens[wait.waiter]
        lines.append(Line(f'w{index}', 'wait', details=('before',), start=start, end=end))
    stands_in: dict[str, str] = {}
    for region in regions.values():
        # What is in a folded region is drawn by the outermost one.
        by = stands_in.get(region.token, region.token if region.is_folded else '')
        if by:
            inside: list[Shape | Region] = [*region.shapes, *region.inner]
            stands_in.update((part.token, by) for part in inside)
    drawn = tuple(_bundle(lines, stands_in))
    return Arrangement(root, drawn, tuple(regions.values()), stands_in)


def _list_regions(box: Box) -> Iterator[tuple[str, str, str]]:
    """Yield the kind, the key and the title of each region around a node or channel."""
    for kind, name in zip(('host', 'worker'), box.place, strict=True):
        if name:
            # No part of a namespace has a space.
            yield kind, f'{kind} {name}', f'{kind} {name}'
    full = ''
    for part in filter(None, box.namespace.split('/')):
        full += f'/{part}'
        yield 'namespace', part, full


def _line(edge: Edge, tokens: dict[str, str], remarks: tuple[str, ...], mark: str) -> Line:
    start, end = edge.ends
    # External ends are drawn.
    delivery = '' if edge.delivery.reason == OUTSIDE else str(edge.delivery)
    return Line(
        tokens[edge.id],
        edge.channel.partition(':')[0],
        details=tuple(map(escape, filter(None, (edge.policies, delivery, edge.followed)))),
        remarks=remarks,
        mark=mark,
        start=tokens[start],
        end=tokens[end],
        role=edge.kind,
    )


def _marks(picture: Picture) -> dict[str, tuple[tuple[str, ...], str]]:
    """Return the remarks and the mark of each part: a message is shown once, else only marked."""
    told: set[int] = set()
    marks = {}
    for part in picture.parts:
        fresh = [picture.findings[index] for index in part.findings if index not in told]
        told.update(part.findings)
        remarks = [
            line
            for finding in fresh[:_MOST_REMARKS]
            for line in textwrap.wrap(
                f'{finding.severity.value}: {escape(finding.message)}', _REMARK_WIDTH
            )
        ]
        if (rest := len(fresh) - _MOST_REMARKS) > 0:
            remarks.append(f'and {rest} more')
        severities = (picture.findings[index].severity.value for index in part.findings)
        # `error` is before `warning`.
        marks[part.id] = tuple(remarks), min(severities, default='')
    return marks


def _bundle(unfolded: Iterable[Line], stands_in: dict[str, str]) -> Iterator[Line]:
    """Yield the lines that are drawn; add to `stands_in` what is drawn for the others."""
    bundles: dict[tuple[str, str, str], list[Line]] = defaultdict(list)
    for line in unfolded:
        start, end = (stands_in.get(token, token) for token in (line.start, line.end))
        if start == end:
            stands_in[line.token] = start
        else:
            # Lines between the same two shapes are drawn apart, unless one is a folded region.
            is_single = (start, end) == (line.start, line.end)
            bundles[start, end, line.token if is_single else line.kind].append(line)
    for index, ((start, end, _), bundle) in enumerate(bundles.items()):
        line = replace(bundle[0], start=start, end=end)
        if len(bundle) > 1:
            line = replace(
                line,
                token=f'm{index}',
                details=count_kinds(each.role for each in bundle if each.role) or line.details,
                remarks=(),
                mark=_worst(bundle),
            )
            stands_in.update({each.token: line.token for each in bundle})
        yield line


def _worst(parts: Sequence[Shape]) -> str:
    return min((part.mark for part in parts if part.mark), default='')


def count_kinds(kinds: Iterable[str]) -> tuple[str, ...]:
    """Return how many there are of each kind, as in `2 processes`."""
    return tuple(count_of(number, kind) for kind, number in Counter(kinds).items())
