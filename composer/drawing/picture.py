"""A checked system → what is to be drawn, the same for all forms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.checks.connections.topology import ChannelKind, Endpoint, Graph, build_graph
from composer.drawing.marks import Marks
from composer.drawing.policies import differing_policies
from composer.names import expand_name, expand_namespace, join_names

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ConditionSpec, NodeSpec, ProcessSpec
    from composer.yaml_text.positions import DataPath, SourceMap

BoxKind: TypeAlias = Literal['node', 'process']
Side: TypeAlias = Literal['providers', 'users']


@dataclass(frozen=True, slots=True)
class Box:
    """A node or a process.

    Attributes:
        id: Its kind and full name, as in `node:/robot/arm`; no two are the same.
        namespace: In full, as in `/robot`.
        findings: What is wrong with it, as indices into those of the picture.
    """

    id: str
    kind: BoxKind
    name: str
    namespace: str
    description: str
    path: DataPath
    findings: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Hub:
    """A topic, service or action.

    Attributes:
        id: Its kind and full name, as in `topic:/robot/scan`.
        types: Those that its ends declare; one, if nothing is wrong.
        namespace: The deepest namespace that all its ends are in.
        external: Which ends are elsewhere, too.
        path: Of the end that is declared first.
        findings: What is wrong with it, as indices into those of the picture.
    """

    id: str
    kind: ChannelKind
    name: str
    types: tuple[str, ...]
    namespace: str
    external: tuple[Side, ...]
    path: DataPath
    findings: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Edge:
    """A publisher, subscription, server or client: what ties a node to a topic, service or action.

    Attributes:
        id: What it is, of which node, and its name there.
        role: In words, as in `service client`.
        qos: The policies that differ from what ROS does by itself; durations in seconds.
        findings: What is wrong with it, as indices into those of the picture.
    """

    id: str
    role: str
    name: str
    box: str
    hub: str
    type: str
    qos: Mapping[str, Any]
    path: DataPath
    findings: tuple[int, ...]

    @property
    def from_box(self) -> bool:
        """Whether it begins at the node: messages, requests and goals leave it."""
        return self.role in ('publisher', 'service client', 'action client')

    @property
    def ends(self) -> tuple[str, str]:
        """Where it begins, and where it ends."""
        return (self.box, self.hub) if self.from_box else (self.hub, self.box)


@dataclass(frozen=True, slots=True)
class Wait:
    """That a node or process starts only when something else is there."""

    box: str
    target: str
    path: DataPath


@dataclass(frozen=True, slots=True)
class Picture:
    """A system as it is drawn; all in the order of the file."""

    name: str
    description: str
    boxes: tuple[Box, ...]
    hubs: tuple[Hub, ...]
    edges: tuple[Edge, ...]
    waits: tuple[Wait, ...]
    findings: tuple[Diagnostic, ...]
    positions: SourceMap

    @property
    def parts(self) -> tuple[Box | Hub | Edge, ...]:
        """All that findings may be about."""
        return (*self.boxes, *self.hubs, *self.edges)


def build_picture(context: CheckContext, findings: Sequence[Diagnostic]) -> Picture:
    """Return what is to be drawn of a system, and where the findings belong in it."""
    graph = build_graph(context)
    marks = Marks(context.system.positions, graph, findings)
    boxes = tuple(_boxes(context, marks))
    ids = {box.path: box.id for box in boxes}
    hubs = tuple(_hubs(graph, marks))
    return Picture(
        context.spec.name,
        context.spec.description,
        boxes,
        hubs,
        tuple(_edges(context, graph, marks, ids)),
        tuple(_waits(context, boxes, hubs, ids)),
        tuple(findings),
        context.system.positions,
    )


def _boxes(context: CheckContext, marks: Marks) -> Iterator[Box]:
    taken: set[str] = set()
    for kind, box in _specs(context):
        namespace = expand_namespace(box.namespace or '')
        full = join_names(namespace, box.name) if kind == 'node' else box.name
        # Two nodes of one name are a fault, and are drawn as two.
        id_ = f'{kind}:{full}'
        while id_ in taken:
            id_ += "'"
        taken.add(id_)
        yield Box(
            id_, kind, box.name, namespace, box.description, box.path, marks.of_box(box.path)
        )


def _specs(context: CheckContext) -> Iterator[tuple[BoxKind, NodeSpec | ProcessSpec]]:
    for node in context.spec.nodes.values():
        yield 'node', node
    for process in context.spec.processes.values():
        yield 'process', process


def _hubs(graph: Graph, marks: Marks) -> Iterator[Hub]:
    for channel in graph.channels.values():
        ends = channel.ends
        sides: list[Side] = []
        if any(getattr(end.entity, 'external', False) for end in channel.users):
            sides.append('providers')
        if any(getattr(end.entity, 'external', False) for end in channel.providers):
            sides.append('users')
        yield Hub(
            f'{channel.kind}:{channel.name}',
            channel.kind,
            channel.name,
            tuple(dict.fromkeys(end.entity.type for end in ends)),
            _common_namespace([end.node.namespace for end in ends]),
            tuple(sides),
            ends[0].path,
            marks.of_hub((channel.kind, channel.name)),
        )


def _common_namespace(namespaces: Sequence[str]) -> str:
    first, *others = [[part for part in each.split('/') if part] for each in namespaces]
    common: list[str] = []
    for place, part in enumerate(first):
        if any(each[place : place + 1] != [part] for each in others):
            break
        common.append(part)
    return '/' + '/'.join(common)


def _edges(
    context: CheckContext, graph: Graph, marks: Marks, ids: Mapping[DataPath, str]
) -> Iterator[Edge]:
    for channel in graph.channels.values():
        for end in channel.ends:
            box = ids[end.node.path]
            yield Edge(
                f'{end.noun}:{box.partition(":")[2]}:{end.entity.name}',
                _role(end),
                end.entity.name,
                box,
                f'{channel.kind}:{channel.name}',
                end.entity.type,
                differing_policies(end.qos, context.spec.qos),
                end.path,
                marks.of_edge(end.path),
            )


def _role(end: Endpoint) -> str:
    return f'{end.noun} server' if end.noun in ('service', 'action') else end.noun


def _waits(
    context: CheckContext, boxes: Sequence[Box], hubs: Sequence[Hub], ids: Mapping[DataPath, str]
) -> Iterator[Wait]:
    known = {box.id for box in boxes} | {hub.id for hub in hubs}
    for _, waiter in _specs(context):
        for condition in waiter.wait_for:
            target = _target(waiter, condition)
            if target in known:
                yield Wait(ids[waiter.path], target, condition.path)


def _target(waiter: NodeSpec | ProcessSpec, condition: ConditionSpec) -> str:
    if condition.kind == 'process':
        return f'process:{condition.name}'
    name = expand_name(condition.name, waiter.name, expand_namespace(waiter.namespace or ''))
    return f'{condition.kind}:{name}'
