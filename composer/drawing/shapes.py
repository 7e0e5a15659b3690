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
from composer.drawing.qos_labels import describe_policies
from composer.records import record
from composer.rules import Severity
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from composer.checks.placement.crossings import Place
    from composer.drawing.picture import ChannelBox, Edge, NodeBox, Picture

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
        details: Smaller lines below the title.
        remarks: The messages of its findings, in lines.
        mark: The worst of its findings, `error` or `warning`; empty if it has none.
    """

    token: str
    id: str
    kind: str
    title: str
    details: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    mark: str = ''


@record
class Line:
    """An arrow between two shapes.

    Attributes:
        id: The id of what it shows; empty for waits and external ends.
        kind: `topic`, `service`, `action`, `external` or `wait`.
        details: The text beside it.
        remarks: The messages of its findings, in lines.
        mark: As for a shape.
    """

    token: str
    id: str
    kind: str
    start: str
    end: str
    details: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    mark: str = ''


@record
class Region:
    """A namespace, a host or a worker, with the shapes in it that are in no deeper region.

    Attributes:
        place: `host NAME` or `worker NAME`; empty for a namespace.
        id: The keys of all regions down to it, as in `box:/worker camera/left`.
    """

    namespace: str
    shapes: list[Shape] = field(default_factory=list)
    inner: dict[str, Region] = field(default_factory=dict)
    place: str = ''
    id: str = 'box:'

    @property
    def title(self) -> str:
        """Its name as it is shown."""
        return escape(self.place or self.namespace)

    @property
    def kind(self) -> str:
        """Return `namespace`, `host` or `worker`."""
        return self.place.partition(' ')[0] or 'namespace'

    def at(self, place: Place) -> Region:
        """Return the region of a host and a worker below this one; add it if it is missing."""
        region = self
        for noun, name in zip(('host', 'worker'), place, strict=True):
            if name:
                # No part of a namespace has a space.
                key = f'{noun} {name}'
                inner = Region(self.namespace, place=key, id=f'{region.id}/{key}')
                region = region.inner.setdefault(key, inner)
        return region

    def within(self, namespace: str) -> Region:
        """Return the region of a namespace below this one; add it if it is missing."""
        region = self
        for part in (part for part in namespace.split('/') if part):
            full = f'{region.namespace.rstrip("/")}/{part}'
            region = region.inner.setdefault(part, Region(full, id=f'{region.id}/{part}'))
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
        regions: All regions, also those that are in a folded one, by their tokens.
        stands_in: The token of what is drawn for each shape and line that is not drawn itself.
    """

    root: Region
    lines: tuple[Line, ...]
    regions: dict[str, Region] = field(default_factory=dict)
    stands_in: dict[str, str] = field(default_factory=dict)


def arrange_shapes(picture: Picture, folded: Collection[str] = ()) -> Arrangement:
    """Return the shapes and lines of a picture.

    Args:
        picture: What is drawn.
        folded: The ids of regions that are drawn as one shape.
    """
    root = Region('/')
    remarks = _Remarks(picture)
    tokens = tokens_of(picture)
    for node in picture.nodes:
        region = root.at(node.place).within(node.namespace)
        region.shapes.append(_node_shape(tokens[node.id], node, remarks))
    for channel in picture.channels:
        region = root.at(channel.place).within(channel.namespace)
        region.shapes.append(_channel_shape(tokens[channel.id], channel, remarks))
    lines = [_edge_line(edge, tokens, remarks) for edge in picture.edges]
    for shape, line in _external_ends(picture.channels, tokens):
        root.shapes.append(shape)
        lines.append(line)
    for index, wait in enumerate(picture.waits):
        ends = tokens[wait.target], tokens[wait.waiter]
        lines.append(Line(f'w{index}', '', 'wait', *ends, details=('before',)))
    regions = {f'g{index}': region for index, region in enumerate(root.walk())}
    drawn = Arrangement(root, tuple(lines), regions)
    return _fold(drawn, {edge.id: edge.role for edge in picture.edges}, folded)


def _fold(drawn: Arrangement, roles: dict[str, str], folded: Collection[str]) -> Arrangement:
    tokens = {region.id: token for token, region in drawn.regions.items()}
    stands_in: dict[str, str] = {}

    def copy(region: Region) -> Region:
        open_ones = {}
        shapes = [*region.shapes]
        for key, inner in region.inner.items():
            if inner.id not in folded:
                open_ones[key] = copy(inner)
                continue
            token, hidden = tokens[inner.id], inner.all_shapes()
            shapes.append(_folded_shape(token, inner, hidden))
            stands_in.update(dict.fromkeys((shape.token for shape in hidden), token))
            stands_in.update(dict.fromkeys((tokens[each.id] for each in inner.walk()), token))
        return replace(region, shapes=shapes, inner=open_ones)

    root = copy(drawn.root)
    bundles: dict[tuple[str, str, str], list[Line]] = defaultdict(list)
    for line in drawn.lines:
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
                details=_count(bundle, roles) or line.details,
                remarks=(),
                mark=_worst(bundle),
            )
            stands_in.update({each.token: line.token for each in bundle})
        lines.append(line)
    return Arrangement(root, tuple(lines), drawn.regions, stands_in)


def _folded_shape(token: str, region: Region, hidden: Sequence[Shape]) -> Shape:
    counts = Counter(shape.kind for shape in hidden if shape.kind != 'external')
    details = tuple(counted(number, kind) for kind, number in counts.items())
    return Shape(token, region.id, 'folded', region.title, details, mark=_worst(hidden))


def _worst(parts: Sequence[Shape] | Sequence[Line]) -> str:
    # `error` is before `warning`.
    return min((part.mark for part in parts if part.mark), default='')


def _count(bundle: Sequence[Line], roles: dict[str, str]) -> tuple[str, ...]:
    counts = Counter(roles[line.id] for line in bundle if line.id)
    return tuple(counted(number, role) for role, number in counts.items())


def counted(number: int, noun: str) -> str:
    """Return a number and a noun, as in `2 processes`."""
    many = 'processes' if noun == 'process' else f'{noun}s'
    return f'{number} {noun if number == 1 else many}'


def tokens_of(picture: Picture) -> dict[str, str]:
    """Return the tokens of nodes, processes, channels and their ends, by their ids."""
    return {
        **{node.id: f'n{index}' for index, node in enumerate(picture.nodes)},
        **{channel.id: f'c{index}' for index, channel in enumerate(picture.channels)},
        **{edge.id: f'e{index}' for index, edge in enumerate(picture.edges)},
    }


def worst_mark(picture: Picture, findings: Iterable[int]) -> str:
    """Return `error`, `warning`, or an empty text if there are no findings."""
    severities = {picture.findings[index].severity for index in findings}
    if Severity.ERROR in severities:
        return Severity.ERROR.value
    return Severity.WARNING.value if severities else ''


class _Remarks:
    """The messages of findings: each is shown once, and its other places are only marked."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture
        self._shown: set[int] = set()

    def take(self, findings: Sequence[int]) -> tuple[str, ...]:
        """Return the lines of those findings that are not shown yet."""
        fresh = [index for index in findings if index not in self._shown]
        self._shown.update(fresh)
        lines = [line for index in fresh[:_MOST_REMARKS] for line in self._lines(index)]
        rest = len(fresh) - _MOST_REMARKS
        return (*lines, f'and {rest} more') if rest > 0 else tuple(lines)

    def mark(self, findings: Sequence[int]) -> str:
        """Return the worst severity; see `worst_mark`."""
        return worst_mark(self._picture, findings)

    def _lines(self, index: int) -> Iterator[str]:
        finding = self._picture.findings[index]
        text = f'{finding.severity.value}: {escape(finding.message)}'
        yield from textwrap.wrap(text, _REMARK_WIDTH)


def _node_shape(token: str, node: NodeBox, remarks: _Remarks) -> Shape:
    return Shape(
        token,
        node.id,
        node.kind,
        escape(node.name),
        remarks=remarks.take(node.findings),
        mark=remarks.mark(node.findings),
    )


def _channel_shape(token: str, channel: ChannelBox, remarks: _Remarks) -> Shape:
    return Shape(
        token,
        channel.id,
        channel.kind,
        escape(channel.name),
        tuple(map(escape, channel.types)),
        remarks.take(channel.findings),
        remarks.mark(channel.findings),
    )


def _edge_line(edge: Edge, tokens: dict[str, str], remarks: _Remarks) -> Line:
    start, end = edge.ends
    # External ends are drawn.
    delivery = '' if edge.delivery.reason == OUTSIDE else str(edge.delivery)
    details = filter(None, (describe_policies(edge.qos), delivery, edge.followed))
    return Line(
        tokens[edge.id],
        edge.id,
        edge.channel.partition(':')[0],
        tokens[start],
        tokens[end],
        tuple(map(escape, details)),
        remarks.take(edge.findings),
        remarks.mark(edge.findings),
    )


def _external_ends(
    channels: Iterable[ChannelBox], tokens: dict[str, str]
) -> Iterator[tuple[Shape, Line]]:
    for channel in channels:
        for side in channel.external:
            token = f'x{tokens[channel.id]}{side[0]}'
            ends = (token, tokens[channel.id])
            if not sends(channel.kind, provides=side == 'providers'):
                ends = ends[::-1]
            shape = Shape(token, channel.id, 'external', 'external')
            yield shape, Line(f'{token}l', '', 'external', *ends)
