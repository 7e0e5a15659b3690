"""A picture → shapes in nested regions, and the lines between them: what mermaid and dot write.

Shapes have short tokens instead of names, so that no name can clash with a word of a language.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.drawing.policies import describe_policies
from composer.reports.text import escape
from composer.rules import Severity

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from composer.drawing.picture import Box, Edge, Hub, Picture

_REMARK_WIDTH = 44
# Of a part with more findings, the rest is counted.
_MOST_REMARKS = 2


@dataclass(frozen=True, slots=True)
class Shape:
    """Something drawn at one place; its texts have nothing in them that cannot be printed.

    Attributes:
        id: Of what it shows; that of its channel if it stands for ends elsewhere.
        kind: `node`, `process`, `topic`, `service`, `action` or `external`.
        details: Smaller lines below the title.
        remarks: What is wrong with it, in lines.
        mark: `error` or `warning`, the worst of its findings; empty if nothing is wrong.
    """

    token: str
    id: str
    kind: str
    title: str
    details: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    mark: str = ''


@dataclass(frozen=True, slots=True)
class Line:
    """Something drawn between two shapes, with an arrow at its end.

    Attributes:
        id: Of what it shows; empty for waits and ends elsewhere.
        kind: `topic`, `service`, `action`, `external` or `wait`.
        details: What is written beside it.
        remarks: What is wrong with it, in lines.
        mark: As of a shape.
    """

    token: str
    id: str
    kind: str
    start: str
    end: str
    details: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    mark: str = ''


@dataclass(frozen=True, slots=True)
class Region:
    """A namespace, with what is in it and in no deeper one."""

    namespace: str
    shapes: list[Shape] = field(default_factory=list)
    inner: dict[str, Region] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The namespace as it is shown."""
        return escape(self.namespace)

    def within(self, namespace: str) -> Region:
        """Return the region of a namespace below this one, which is made if need be."""
        region = self
        for part in (part for part in namespace.split('/') if part):
            full = f'{region.namespace.rstrip("/")}/{part}'
            region = region.inner.setdefault(part, Region(full))
        return region


@dataclass(frozen=True, slots=True)
class Plan:
    """All that is drawn; what has no namespace is in `root` itself."""

    root: Region
    lines: tuple[Line, ...]


def plan_picture(picture: Picture) -> Plan:
    """Return what is drawn of a picture, and where."""
    root = Region('/')
    remarks = _Remarks(picture)
    tokens = tokens_of(picture)
    for box in picture.boxes:
        root.within(box.namespace).shapes.append(_box_shape(tokens[box.id], box, remarks))
    for hub in picture.hubs:
        root.within(hub.namespace).shapes.append(_hub_shape(tokens[hub.id], hub, remarks))
    lines = [_edge_line(edge, tokens, remarks) for edge in picture.edges]
    for shape, line in _ends_elsewhere(picture.hubs, tokens):
        root.shapes.append(shape)
        lines.append(line)
    for index, wait in enumerate(picture.waits):
        ends = tokens[wait.target], tokens[wait.box]
        lines.append(Line(f'w{index}', '', 'wait', *ends, details=('before',)))
    return Plan(root, tuple(lines))


def tokens_of(picture: Picture) -> dict[str, str]:
    """Return the tokens of nodes, processes, channels and their ends, by their ids."""
    return {
        **{box.id: f'n{index}' for index, box in enumerate(picture.boxes)},
        **{hub.id: f'c{index}' for index, hub in enumerate(picture.hubs)},
        **{edge.id: f'e{index}' for index, edge in enumerate(picture.edges)},
    }


def worst_mark(picture: Picture, findings: Iterable[int]) -> str:
    """Return `error`, `warning`, or an empty text if there are no findings."""
    severities = {picture.findings[index].severity for index in findings}
    if Severity.ERROR in severities:
        return Severity.ERROR.value
    return Severity.WARNING.value if severities else ''


class _Remarks:
    """What findings say, each where it is met first; where else it belongs, a mark must do."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture
        self._told: set[int] = set()

    def tell(self, findings: Sequence[int]) -> tuple[str, ...]:
        """Return the lines of those findings that nothing else has told."""
        fresh = [index for index in findings if index not in self._told]
        self._told.update(fresh)
        lines = [line for index in fresh[:_MOST_REMARKS] for line in self._lines(index)]
        rest = len(fresh) - _MOST_REMARKS
        return (*lines, f'and {rest} more') if rest > 0 else tuple(lines)

    def mark(self, findings: Sequence[int]) -> str:
        """Return the worst that they are."""
        return worst_mark(self._picture, findings)

    def _lines(self, index: int) -> Iterator[str]:
        finding = self._picture.findings[index]
        text = f'{finding.severity.value}: {escape(finding.message)}'
        yield from textwrap.wrap(text, _REMARK_WIDTH)


def _box_shape(token: str, box: Box, remarks: _Remarks) -> Shape:
    return Shape(
        token,
        box.id,
        box.kind,
        escape(box.name),
        remarks=remarks.tell(box.findings),
        mark=remarks.mark(box.findings),
    )


def _hub_shape(token: str, hub: Hub, remarks: _Remarks) -> Shape:
    return Shape(
        token,
        hub.id,
        hub.kind,
        escape(hub.name),
        tuple(map(escape, hub.types)),
        remarks.tell(hub.findings),
        remarks.mark(hub.findings),
    )


def _edge_line(edge: Edge, tokens: dict[str, str], remarks: _Remarks) -> Line:
    start, end = edge.ends
    policies = describe_policies(edge.qos)
    return Line(
        tokens[edge.id],
        edge.id,
        edge.hub.partition(':')[0],
        tokens[start],
        tokens[end],
        (escape(policies),) if policies else (),
        remarks.tell(edge.findings),
        remarks.mark(edge.findings),
    )


def _ends_elsewhere(hubs: Iterable[Hub], tokens: dict[str, str]) -> Iterator[tuple[Shape, Line]]:
    for hub in hubs:
        for side in hub.external:
            token = f'x{tokens[hub.id]}{side[0]}'
            # Messages come from publishers, but requests and goals from clients.
            begins = (side == 'providers') == (hub.kind == 'topic')
            ends = (token, tokens[hub.id]) if begins else (tokens[hub.id], token)
            shape = Shape(token, hub.id, 'external', 'elsewhere')
            yield shape, Line(f'{token}l', '', 'external', *ends)
