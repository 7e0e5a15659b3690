"""A picture → boxes in nested regions, and lines between them: what mermaid and dot write."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import field, replace
from typing import TYPE_CHECKING

from composer.drawing.picture import Box, Edge, Part
from composer.names import count_of
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from composer.drawing.picture import Picture

# A topic with one publisher is a line to each subscription, if there are no more.
_MOST_SUBSCRIPTIONS = 2


@record
class Region(Part):
    """A namespace, a host or a worker, with the boxes in it that are in no deeper region.

    Attributes:
        id: The keys of all regions down to it, as in `box:/worker camera/left`.
        kind: `namespace`, `host` or `worker`.
        name: As its title has it; that of a namespace is full.
        is_folded: Whether one box is drawn for all of it.
        topics: Those that are drawn as lines, not as boxes.
    """

    is_folded: bool = False
    boxes: list[Box] = field(default_factory=list)
    topics: list[Box] = field(default_factory=list)
    inner: list[Region] = field(default_factory=list)

    def all_boxes(self) -> list[Box]:
        """Return the boxes and topics in it and in all regions below."""
        inner = (box for region in self.inner for box in region.all_boxes())
        return [*self.boxes, *self.topics, *inner]

    def as_box(self) -> Box:
        """Return what is drawn for all of it when it is folded."""
        hidden = self.all_boxes()
        details = count_kinds(box.kind for box in hidden)
        return Box(self.token, 'folded', name=self.name, details=details, mark=_worst(hidden))


@record
class Arrangement:
    """All boxes and lines; boxes without a namespace are in `root` itself.

    Attributes:
        lines: The name of one is that of the topic that is drawn as a line; others show none.
        regions: All regions, each before those in it.
        stands_in: The token of what is drawn for each box, line and region that is in a folded
            region, for each line that is drawn with others as one, and for the ends of a topic
            that is drawn as a line.
    """

    picture: Picture
    root: Region
    lines: tuple[Edge, ...]
    regions: tuple[Region, ...]
    stands_in: dict[str, str]


def arrange(picture: Picture, folded: Collection[str] = ()) -> Arrangement:
    """Return the regions and lines of a picture.

    Args:
        folded: The ids of regions that are drawn as one box.
    """
    outside = [edge for channel in picture.channels for edge in channel.outside]
    edges = [*picture.edges, *outside]
    topics = _find_topic_lines(picture, edges)
    root, regions = _nest(picture, topics, folded)
    root.boxes.extend({edge.node.token: edge.node for edge in outside}.values())
    hidden: dict[str, Box] = {}
    for region in regions:
        # What is in a folded region is drawn by the outermost one.
        by = hidden.get(region.token) or (region.as_box() if region.is_folded else None)
        if by:
            inside: list[Box | Region] = [*region.boxes, *region.topics, *region.inner]
            hidden.update((part.token, by) for part in inside)
    stands_in = {token: box.token for token, box in hidden.items()}
    lines: list[Edge] = []
    for edge in edges:
        if edge.channel.token not in topics:
            lines.append(replace(edge, name=''))
        elif edge.role == 'publisher':
            lines += _join(topics[edge.channel.token])
    drawn = tuple(_bundle([*lines, *picture.waits], hidden, stands_in))
    shown = {line.token for line in drawn}
    for token, ends in topics.items():
        for end in ends:
            if end.token not in shown:
                stands_in.setdefault(end.token, stands_in.get(token, token))
    return Arrangement(picture, root, drawn, regions, stands_in)


def _nest(
    picture: Picture, topics: Collection[str], folded: Collection[str]
) -> tuple[Region, tuple[Region, ...]]:
    """Return the outermost region, and all others, with the boxes in them."""
    root, regions = Region('', 'namespace', 'box:', '/'), dict[str, Region]()
    for box in (*picture.nodes, *picture.channels):
        region = root
        for kind, key, name in _list_regions(box):
            id_ = f'{region.id}/{key}'
            if id_ not in regions:
                token = f'g{len(regions)}'
                regions[id_] = Region(token, kind, id_, name, is_folded=id_ in folded)
                region.inner.append(regions[id_])
            region = regions[id_]
        (region.topics if box.token in topics else region.boxes).append(box)
    return root, tuple(regions.values())


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


def _find_topic_lines(picture: Picture, edges: Iterable[Edge]) -> dict[str, list[Edge]]:
    """Return the ends of topics that are read best as lines, by their tokens; publisher first."""
    ends: dict[str, list[Edge]] = defaultdict(list)
    # The sort is stable.
    for edge in sorted(edges, key=lambda edge: edge.role != 'publisher'):
        ends[edge.channel.token].append(edge)
    waited_for = {box.token for wait in picture.waits for box in (wait.start, wait.end)}
    return {
        token: of_topic
        for token, of_topic in ends.items()
        if token not in waited_for
        and [end.role for end in of_topic].count('publisher') == 1
        and 1 < len(of_topic) == len({end.node.token for end in of_topic})
        and len(of_topic) <= 1 + _MOST_SUBSCRIPTIONS
    }


def _join(ends: Sequence[Edge]) -> Iterator[Edge]:
    """Yield a line from the publisher of a topic to each subscription; the first is the topic."""
    publisher, *others = ends
    topic = publisher.channel
    for index, end in enumerate(others):
        parts = (publisher, end) if index else (publisher, topic, end)
        yield Edge(
            end.token if index else topic.token,
            'external' if 'external' in (publisher.kind, end.kind) else topic.kind,
            name=topic.name,
            details=tuple(dict.fromkeys((*topic.details, *publisher.details, *end.details))),
            remarks=tuple(remark for part in parts for remark in part.remarks),
            mark=_worst(parts),
            start=publisher.node,
            end=end.node,
            role=end.role if index else publisher.role,
        )


def _bundle(
    lines: Iterable[Edge], hidden: dict[str, Box], stands_in: dict[str, str]
) -> Iterator[Edge]:
    """Yield the lines that are drawn; add to `stands_in` what is drawn for the others."""
    bundles: dict[tuple[str, str, str], list[Edge]] = defaultdict(list)
    for line in lines:
        start, end = (hidden.get(box.token, box) for box in (line.start, line.end))
        if start is end:
            stands_in[line.token] = start.token
        else:
            # Lines between the same two boxes are drawn apart, unless one is a folded region.
            is_single = start is line.start and end is line.end
            key = (start.token, end.token, line.token if is_single else line.kind)
            bundles[key].append(replace(line, start=start, end=end))
    for index, bundle in enumerate(bundles.values()):
        line = bundle[0]
        if len(bundle) > 1:
            details = count_kinds(each.role for each in bundle if each.role) or line.details
            line = Edge(
                f'm{index}',
                line.kind,
                details=details,
                mark=_worst(bundle),
                start=line.start,
                end=line.end,
            )
            stands_in.update({each.token: line.token for each in bundle})
        yield line


def _worst(parts: Sequence[Part]) -> str:
    return min((part.mark for part in parts if part.mark), default='')


def count_kinds(kinds: Iterable[str]) -> tuple[str, ...]:
    """Return how many there are of each kind, as in `2 processes`."""
    return tuple(count_of(number, kind) for kind, number in Counter(kinds).items())
