"""A picture → shapes in nested regions, and lines between them: what mermaid and dot write.

Shapes have short tokens instead of names: no name can clash with a keyword of a language.
"""

from __future__ import annotations

import textwrap
from collections import Counter, defaultdict
from dataclasses import field, replace
from itertools import count
from typing import TYPE_CHECKING

from composer.drawing.delivery import OUTSIDE
from composer.drawing.picture import sends
from composer.names import count_of
from composer.records import record
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from composer.checks.placement.crossings import Place
    from composer.drawing.picture import Edge, Picture

_REMARK_WIDTH = 44
# Of a part with more findings, the rest is counted.
_MOST_REMARKS = 2


@record
class Shape:
    """A node, process or channel as it is drawn; all of its texts are printable.

    Attributes:
        id: The id of what it shows; of the channel, if it stands for external ends.
        kind: `node`, `process`, `topic`, `service`, `action` or `external`; of a folded region,
            `folded`.
        title: Empty for a line.
        details: Smaller lines below the title.
        remarks: The messages of its findings, in lines.
        mark: The worst of its findings, `error` or `warning`; empty if it has none.
    """

    token: str
    id: str
    kind: str
    title: str = ''
    details: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    mark: str = ''


@record
class Line(Shape):
    """An arrow between two shapes, with its details beside it.

    Its `id` is empty for waits and external ends, and its `kind` may be `wait`.
    """

    start: str = ''
    end: str = ''


@record
class Region:
    """A namespace, a host or a worker, with the shapes in it that are in no deeper region.

    Attributes:
        id: The keys of all regions down to it, as in `box:/worker camera/left`.
        kind: `namespace`, `host` or `worker`.
        title: Its printable name; a namespace in full.
    """

    token: str = ''
    id: str = 'box:'
    kind: str = 'namespace'
    title: str = '/'
    shapes: list[Shape] = field(default_factory=list)
    inner: dict[str, Region] = field(default_factory=dict)

    def below(self, place: Place, namespace: str, numbers: Iterator[int]) -> Region:
        """Return the region of a host, a worker and a namespace; add those that are missing.

        Args:
            numbers: For their tokens.
        """
        # No part of a namespace has a space.
        places = zip(('host', 'worker'), place, strict=True)
        keys = [(noun, f'{noun} {name}', f'{noun} {name}') for noun, name in places if name]
        full = ''
        for part in filter(None, namespace.split('/')):
            full += f'/{part}'
            keys.append(('namespace', part, full))
        region = self
        for kind, key, title in keys:
            if key not in region.inner:
                token, id_ = f'g{next(numbers)}', f'{region.id}/{key}'
                region.inner[key] = Region(token, id_, kind, escape(title))
            region = region.inner[key]
        return region

    def walk(self) -> Iterator[Region]:
        """Yield the regions below this one, each before those in it."""
        for region in self.inner.values():
            yield region
            yield from region.walk()

    def all_shapes(self) -> list[Shape]:
        """Return the shapes in it and in all regions below."""
        return [*self.shapes, *(shape for region in self.walk() for shape in region.shapes)]


@record
class Arrangement:
    """All shapes and lines; shapes without a namespace are in `root` itself.

    Attributes:
        regions: All regions, also those that are in a folded one.
        stands_in: The token of what is drawn for each shape and line that is not drawn itself.
    """

    root: Region
    lines: tuple[Line, ...]
    regions: tuple[Region, ...]
    stands_in: dict[str, str]


def arrange_shapes(picture: Picture, folded: Collection[str] = ()) -> Arrangement:
    """Return the shapes and lines of a picture.

    Args:
        picture: What is drawn.
        folded: The ids of regions that are drawn as one shape.
    """
    root = Region()
    tokens, marks, numbers = picture.tokens(), _marks(picture), count()
    for box in (*picture.nodes, *picture.channels):
        details = tuple(map(escape, box.types))
        shape = Shape(tokens[box.id], box.id, box.kind, escape(box.name), details, *marks[box.id])
        root.below(box.place, box.namespace, numbers).shapes.append(shape)
    lines = [_line(edge, tokens, *marks[edge.id]) for edge in picture.edges]
    for channel in picture.channels:
        for side in channel.external:
            token = f'x{tokens[channel.id]}{side[0]}'
            root.shapes.append(Shape(token, channel.id, 'external', 'external'))
            ends = [token, tokens[channel.id]]
            if not sends(channel.kind, provides=side == 'providers'):
                ends.reverse()
            lines.append(Line(f'{token}l', '', 'external', start=ends[0], end=ends[1]))
    for index, wait in enumerate(picture.waits):
        start, end = tokens[wait.target], tokens[wait.waiter]
        lines.append(Line(f'w{index}', '', 'wait', details=('before',), start=start, end=end))
    return _fold(root, lines, {edge.id: edge.role for edge in picture.edges}, folded)


def _line(edge: Edge, tokens: dict[str, str], remarks: tuple[str, ...], mark: str) -> Line:
    start, end = edge.ends
    # External ends are drawn.
    delivery = '' if edge.delivery.reason == OUTSIDE else str(edge.delivery)
    return Line(
        tokens[edge.id],
        edge.id,
        edge.channel.partition(':')[0],
        details=tuple(map(escape, filter(None, (edge.policies, delivery, edge.followed)))),
        remarks=remarks,
        mark=mark,
        start=tokens[start],
        end=tokens[end],
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


def _fold(
    root: Region, unfolded: Sequence[Line], roles: dict[str, str], folded: Collection[str]
) -> Arrangement:
    stands_in: dict[str, str] = {}

    def copy(region: Region) -> Region:
        open_ones = {}
        shapes = [*region.shapes]
        for key, inner in region.inner.items():
            if inner.id not in folded:
                open_ones[key] = copy(inner)
                continue
            hidden = inner.all_shapes()
            shapes.append(_folded_shape(inner, hidden))
            inside: list[Shape | Region] = [*hidden, *inner.walk()]
            stands_in.update((part.token, inner.token) for part in inside)
        return replace(region, shapes=shapes, inner=open_ones)

    drawn = copy(root)
    bundles: dict[tuple[str, str, str], list[Line]] = defaultdict(list)
    for line in unfolded:
        start, end = (stands_in.get(token, token) for token in (line.start, line.end))
        if start == end:
            stands_in[line.token] = start
        else:
            # Lines between the same two shapes are drawn apart, unless one is a folded region.
            is_single = (start, end) == (line.start, line.end)
            bundles[start, end, line.token if is_single else line.kind].append(line)
    lines = []
    for index, ((start, end, _), bundle) in enumerate(bundles.items()):
        line = replace(bundle[0], start=start, end=end)
        if len(bundle) > 1:
            line = replace(
                line,
                token=f'm{index}',
                id='',
                details=count_kinds(roles[each.id] for each in bundle if each.id) or line.details,
                remarks=(),
                mark=_worst(bundle),
            )
            stands_in.update({each.token: line.token for each in bundle})
        lines.append(line)
    return Arrangement(drawn, tuple(lines), tuple(root.walk()), stands_in)


def _folded_shape(region: Region, hidden: Sequence[Shape]) -> Shape:
    details = count_kinds(shape.kind for shape in hidden if shape.kind != 'external')
    return Shape(region.token, region.id, 'folded', region.title, details, mark=_worst(hidden))


def _worst(parts: Sequence[Shape]) -> str:
    return min((part.mark for part in parts if part.mark), default='')


def count_kinds(kinds: Iterable[str]) -> tuple[str, ...]:
    """Return how many there are of each kind, as in `2 processes`."""
    return tuple(count_of(number, kind) for kind, number in Counter(kinds).items())
