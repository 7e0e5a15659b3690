"""A picture → boxes in nested regions, and lines between them: what mermaid and dot write."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import field, replace
from typing import TYPE_CHECKING

from composer.drawing.picture import Box, Edge, sends
from composer.entity_kinds import CHANNEL_KINDS
from composer.names import count_of
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from composer.drawing.picture import Part, Picture

# A topic with one publisher is a line to each subscription, if there are no more.
_MOST_SUBSCRIPTIONS = 2


@record
class Region:
    """A namespace, a host or a worker, with the boxes in it that are in no deeper region.

    Attributes:
        id: The keys of all regions down to it, as in `box:/worker camera/left`.
        kind: `namespace`, `host` or `worker`.
        title: Its name; a namespace in full.
        is_folded: Whether one box is drawn for all of it.
        topics: Those that are drawn as lines, not as boxes.
    """

    token: str = ''
    id: str = 'box:'
    kind: str = 'namespace'
    title: str = '/'
    is_folded: bool = False
    boxes: list[Box] = field(default_factory=list)
    topics: list[Box] = field(default_factory=list)
    inner: list[Region] = field(default_factory=list)

    def all_boxes(self) -> list[Box]:
        """Return the boxes and topics in it and in all regions below."""
        inner = (box for each in self.inner for box in each.all_boxes())
        return [*self.boxes, *self.topics, *inner]

    def as_box(self) -> Box:
        """Return what is drawn for all of it when it is folded."""
        hidden = self.all_boxes()
        details = count_kinds(box.kind for box in hidden)
        return Box(self.token, 'folded', name=self.title, details=details, mark=_worst(hidden))


@record
class Arrangement:
    """All boxes and lines; boxes without a namespace are in `root` itself.

    Attributes:
        regions: All regions, each before those in it.
        stands_in: The token of what is drawn for each box, line and region that is in a folded
            region, for each line that is drawn with others as one, and for the ends of a topic
            that is drawn as a line.
    """

    root: Region
    lines: tuple[Edge, ...]
    regions: tuple[Region, ...]
    stands_in: dict[str, str]


def arrange(picture: Picture, folded: Collection[str] = ()) -> Arrangement:
    """Return the regions and lines of a picture.

    Args:
        folded: The ids of regions that are drawn as one box.
    """
    outside = [edge for channel in picture.channels for edge in list_outside(channel)]
    edges = [*picture.edges, *outside]
    topics = dict(_list_topic_lines(picture, edges))
    of_topics = {end.token: token for token, ends in topics.items() for end in ends}
    root, regions = _nest(picture, topics, folded)
    lines: list[Edge] = []
    for edge in edges:
        if edge.token not in of_topics:
            lines.append(edge)
        elif edge.role == 'publisher':
            lines += _join(topics[of_topics[edge.token]])
    root.boxes.extend({edge.node.token: edge.node for edge in outside}.values())
    stands_in: dict[str, Box] = {}
    for region in regions.values():
        # What is in a folded region is drawn by the outermost one.
        by = stands_in.get(region.token) or (region.as_box() if region.is_folded else None)
        if by:
            inside: list[Box | Region] = [*region.boxes, *region.topics, *region.inner]
            stands_in.update((part.token, by) for part in inside)
    replaced = {token: box.token for token, box in stands_in.items()}
    drawn = tuple(_bundle([*lines, *picture.waits], stands_in, replaced))
    shown = {line.token for line in drawn}
    ends_shown = {end: replaced.get(topic, topic) for end, topic in of_topics.items()}
    replaced = {**{end: by for end, by in ends_shown.items() if end not in shown}, **replaced}
    return Arrangement(root, drawn, tuple(regions.values()), replaced)


def list_outside(channel: Box) -> Iterator[Edge]:
    """Yield a line for each kind of ends outside; all channels share the box of a kind."""
    for kind in CHANNEL_KINDS:
        side = 'providers' if kind.provides else 'users'
        if kind.channel == channel.kind and side in channel.external:
            box = Box(f'x{kind.channel[0]}{side[0]}', 'external', name=f'external {kind.noun}s')
            sent = sends(channel.kind, provides=kind.provides)
            start, end = (box, channel) if sent else (channel, box)
            token = f'x{channel.token}{side[0]}'
            yield Edge(token, 'external', start=start, end=end, role=kind.noun)


def _nest(
    picture: Picture, topics: Collection[str], folded: Collection[str]
) -> tuple[Region, dict[str, Region]]:
    """Return the outermost region, and all others by their ids, with the boxes in them."""
    root, regions = Region(), dict[str, Region]()
    for box in (*picture.nodes, *picture.channels):
        region = root
        for kind, key, title in _list_regions(box):
            id_ = f'{region.id}/{key}'
            if id_ not in regions:
                regions[id_] = Region(f'g{len(regions)}', id_, kind, title, id_ in folded)
                region.inner.append(regions[id_])
            region = regions[id_]
        (region.topics if box.token in topics else region.boxes).append(box)
    return root, regions


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


def _list_topic_lines(picture: Picture, edges: Iterable[Edge]) -> Iterator[tuple[str, list[Edge]]]:
    """Yield the tokens and ends of topics that are read best as lines, the publisher first."""
    ends: dict[str, list[Edge]] = defaultdict(list)
    # The sort is stable.
    for edge in sorted(edges, key=lambda edge: edge.role != 'publisher'):
        ends[edge.channel.token].append(edge)
    waited_for = {box.token for wait in picture.waits for box in (wait.start, wait.end)}
    for channel in picture.channels:
        roles = [end.role for end in ends[channel.token]]
        nodes = {end.node.token for end in ends[channel.token]}
        if (
            channel.kind == 'topic'
            and channel.token not in waited_for
            and roles.count('publisher') == 1
            and 1 < len(roles) == len(nodes) <= 1 + _MOST_SUBSCRIPTIONS
        ):
            yield channel.token, ends[channel.token]


def _join(ends: Sequence[Edge]) -> Iterator[Edge]:
    """Yield a line from the publisher of a topic to each subscription; the first is the topic."""
    publisher, *others = ends
    topic = publisher.channel
    for index, end in enumerate(others):
        parts = (publisher, end) if index else (publisher, topic, end)
        yield replace(
            end if index else replace(publisher, token=topic.token),
            kind='external' if 'external' in (publisher.kind, end.kind) else topic.kind,
            details=tuple(dict.fromkeys((*topic.details, *publisher.details, *end.details))),
            topic=topic.name,
            remarks=tuple(remark for part in parts for remark in part.remarks),
            mark=_worst(parts),
            start=publisher.node,
            end=end.node,
        )


def _bundle(
    unfolded: Iterable[Edge], stands_in: dict[str, Box], replaced: dict[str, str]
) -> Iterator[Edge]:
    """Yield the lines that are drawn; add to `replaced` what is drawn for the others."""
    bundles: dict[tuple[str, str, str], list[Edge]] = defaultdict(list)
    for line in unfolded:
        start, end = (stands_in.get(box.token, box) for box in (line.start, line.end))
        if start is end:
            replaced[line.token] = start.token
        else:
            # Lines between the same two boxes are drawn apart, unless one is a folded region.
            is_single = start is line.start and end is line.end
            key = (start.token, end.token, line.token if is_single else line.kind)
            bundles[key].append(replace(line, start=start, end=end))
    for index, bundle in enumerate(bundles.values()):
        line = bundle[0]
        if len(bundle) > 1:
            line = replace(
                line,
                token=f'm{index}',
                details=count_kinds(each.role for each in bundle if each.role) or line.details,
                topic='',
                remarks=(),
                mark=_worst(bundle),
            )
            replaced.update({each.token: line.token for each in bundle})
        yield line


def _worst(parts: Sequence[Part]) -> str:
    return min((part.mark for part in parts if part.mark), default='')


def count_kinds(kinds: Iterable[str]) -> tuple[str, ...]:
    """Return how many there are of each kind, as in `2 processes`."""
    return tuple(count_of(number, kind) for kind, number in Counter(kinds).items())
