"""A checked system → a picture: its nodes, channels and edges, the same for all formats."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.checks.placement.crossings import place_of
from composer.confidential import conceal, hidden_values
from composer.drawing.delivery import deliveries_of
from composer.drawing.finding_places import FindingPlaces
from composer.drawing.qos_labels import differing_policies
from composer.language.specs import ComponentSpec
from composer.names import expand_name, expand_namespace, join_names
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from composer.checks.connections.topology import Endpoint, Topology
    from composer.checks.context import CheckContext
    from composer.checks.placement.crossings import Place
    from composer.diagnostics import Diagnostic
    from composer.drawing.delivery import Delivery
    from composer.entity_kinds import ChannelKind
    from composer.language.specs import ConditionSpec, NodeSpec, ProcessSpec
    from composer.yaml_text.positions import DataPath, SourceMap

NodeKind: TypeAlias = Literal['node', 'process']
Side: TypeAlias = Literal['providers', 'users']


@record
class NodeBox:
    """A node or a process.

    Attributes:
        id: Its kind and full name, as in `node:/robot/arm`; no two are the same.
        namespace: In full, as in `/robot`.
        findings: Its findings, as indices into those of the picture.
        place: The host and the worker that it runs in; empty for those that the file names not.
    """

    id: str
    kind: NodeKind
    name: str
    namespace: str
    description: str
    path: DataPath
    findings: tuple[int, ...]
    place: Place


@record
class ChannelBox:
    """A topic, service or action.

    Attributes:
        id: Its kind and full name, as in `topic:/robot/scan`.
        types: The types that its ends declare; more than one is an error.
        namespace: The deepest one that has all its ends.
        external: The sides on which an end is outside the system, by `external: true`.
        path: The path of the end that is declared first.
        findings: Its findings, as indices into those of the picture.
        place: The host and the worker that have all its ends; empty if none has.
    """

    id: str
    kind: ChannelKind
    name: str
    types: tuple[str, ...]
    namespace: str
    external: tuple[Side, ...]
    path: DataPath
    findings: tuple[int, ...]
    place: Place


@record
class Edge:
    """A publisher, subscription, server or client: it connects a node with a channel.

    Attributes:
        id: Its kind, the full name of its node, and its name, as in `publisher:/robot/arm:scan`.
        role: Its kind in words, as in `service client` and `service server`.
        begins_at_node: Whether messages, requests or goals leave the node here.
        qos: The policies that differ from the default of ROS; durations in seconds.
        delivery: Which way its messages, calls or goals go.
        by_parameter: The parameters that its name or depth follows, by these keys.
        findings: Its findings, as indices into those of the picture.
    """

    id: str
    role: str
    begins_at_node: bool
    name: str
    node: str
    channel: str
    type: str
    qos: Mapping[str, Any]
    delivery: Delivery
    path: DataPath
    findings: tuple[int, ...]
    by_parameter: Mapping[str, str]

    @property
    def ends(self) -> tuple[str, str]:
        """The ids of where it begins and where it ends."""
        return (self.node, self.channel) if self.begins_at_node else (self.channel, self.node)

    @property
    def followed(self) -> str:
        """What follows parameters, in words; empty for nothing."""
        return ', '.join(f'{key} by parameter {name}' for key, name in self.by_parameter.items())


@record
class Wait:
    """A node or process that starts only when something else is ready.

    Attributes:
        waiter: The id of the node or process.
        target: The id of the process or channel.
    """

    waiter: str
    target: str
    path: DataPath


@record
class Picture:
    """A system as it is drawn, in the order of the file."""

    name: str
    description: str
    nodes: tuple[NodeBox, ...]
    channels: tuple[ChannelBox, ...]
    edges: tuple[Edge, ...]
    waits: tuple[Wait, ...]
    findings: tuple[Diagnostic, ...]
    positions: SourceMap

    @property
    def parts(self) -> tuple[NodeBox | ChannelBox | Edge, ...]:
        """All that may have findings."""
        return (*self.nodes, *self.channels, *self.edges)


def build_picture(context: CheckContext, findings: Sequence[Diagnostic]) -> Picture:
    """Return the picture of a system, with the findings at the parts that they are about."""
    topology = context.topology
    places = FindingPlaces(context.system.positions, topology, findings)
    nodes = tuple(_nodes(context, places))
    ids = {node.path: node.id for node in nodes}
    channels = tuple(_channels(topology, places))
    picture = Picture(
        context.spec.name,
        context.spec.description,
        nodes,
        channels,
        tuple(_edges(context, topology, places, ids)),
        tuple(_waits(context, nodes, channels, ids)),
        tuple(findings),
        context.system.positions,
    )
    return _concealed(picture, _Names()) if hidden_values() else picture


class _Names:
    """What is shown for names and ids: those that differ still do."""

    def __init__(self) -> None:
        self._shown: dict[str, str] = {}
        self._taken: set[str] = set()

    def show(self, text: str) -> str:
        if text not in self._shown:
            shown = concealed = conceal(text)
            number = 1
            while shown != text and shown in self._taken:
                number += 1
                shown = f'{concealed} {number}'
            self._shown[text] = shown
            self._taken.add(shown)
        return self._shown[text]


def _concealed(value: Any, names: _Names) -> Any:
    """Return a part of a picture with the origins of hidden values in their place."""
    if isinstance(value, str):
        return names.show(value)
    if isinstance(value, tuple):
        return tuple(_concealed(each, names) for each in value)
    if isinstance(value, Picture | NodeBox | ChannelBox | Edge | Wait):
        inner = {each.name: getattr(value, each.name) for each in fields(value)}
        # By its path a part is found in the file.
        known = {'path', 'findings', 'kind', 'external', 'place', 'positions'}
        return replace(
            value, **{k: _concealed(v, names) for k, v in inner.items() if k not in known}
        )
    return value


def _nodes(context: CheckContext, places: FindingPlaces) -> Iterator[NodeBox]:
    taken: set[str] = set()
    for kind, node in _specs(context):
        namespace = expand_namespace(node.namespace or '')
        full = join_names(namespace, node.name) if kind == 'node' else node.name
        # Two nodes with one name are an error, and are drawn as two.
        id_ = f'{kind}:{full}'
        while id_ in taken:
            id_ += "'"
        taken.add(id_)
        yield NodeBox(
            id_,
            kind,
            node.name,
            namespace,
            node.description,
            node.path,
            places.of_node(node.path),
            _place_of(context, node),
        )


def _place_of(context: CheckContext, node: NodeSpec | ProcessSpec | ComponentSpec) -> Place:
    if isinstance(node, ComponentSpec):
        return context.spec.processes[node.container].host, ''
    return node.host, getattr(node, 'worker', '')


def _specs(
    context: CheckContext,
) -> Iterator[tuple[NodeKind, NodeSpec | ProcessSpec | ComponentSpec]]:
    for node in context.spec.nodes.values():
        yield 'node', node
    for process in context.spec.processes.values():
        yield 'process', process
    for component in context.spec.components:
        yield 'node', component


def _channels(topology: Topology, places: FindingPlaces) -> Iterator[ChannelBox]:
    for channel in topology.channels.values():
        ends = channel.ends
        sides: list[Side] = []
        if any(getattr(end.entity, 'external', False) for end in channel.users):
            sides.append('providers')
        if any(getattr(end.entity, 'external', False) for end in channel.providers):
            sides.append('users')
        yield ChannelBox(
            f'{channel.kind}:{channel.name}',
            channel.kind,
            channel.name,
            tuple(dict.fromkeys(end.entity.type for end in ends)),
            _common_namespace([end.node.namespace for end in ends]),
            tuple(sides),
            ends[0].path,
            places.of_channel((channel.kind, channel.name)),
            _common_place([place_of(end) for end in ends]),
        )


def _common_place(places: Sequence[Place]) -> Place:
    hosts, workers = ({place[part] for place in places} for part in (0, 1))
    if len(hosts) > 1:
        return '', ''
    return hosts.pop(), workers.pop() if len(workers) == 1 else ''


def _common_namespace(namespaces: Sequence[str]) -> str:
    first, *others = [[part for part in each.split('/') if part] for each in namespaces]
    common: list[str] = []
    for place, part in enumerate(first):
        if any(each[place : place + 1] != [part] for each in others):
            break
        common.append(part)
    return '/' + '/'.join(common)


def _edges(
    context: CheckContext, topology: Topology, places: FindingPlaces, ids: Mapping[DataPath, str]
) -> Iterator[Edge]:
    for channel in topology.channels.values():
        deliveries = dict(deliveries_of(channel, context.spec.qos))
        for end in channel.ends:
            # A process may have several nodes; components are drawn apart.
            boxed = end.node.path if end.node.path in ids else end.node.path[:2]
            node = ids[boxed]
            inner = '' if boxed == end.node.path else str(end.node.path[-1])
            owner = '/'.join(filter(None, (node.partition(':')[2], inner)))
            yield Edge(
                f'{end.kind.noun}:{owner}:{end.entity.name}',
                _role(end),
                sends(channel.kind, provides=end.kind.provides),
                end.entity.name,
                node,
                f'{channel.kind}:{channel.name}',
                end.entity.type,
                differing_policies(end.qos, context.spec.qos),
                deliveries[end.path],
                end.path,
                places.of_edge(end.path),
                {
                    key: each.parameter
                    for key, each in getattr(end.entity, 'by_parameter', {}).items()
                },
            )


def sends(channel: ChannelKind, *, provides: bool) -> bool:
    """Return whether an end sends: publishers send messages, and clients requests and goals."""
    return provides == (channel == 'topic')


def _role(end: Endpoint) -> str:
    return f'{end.kind.noun} server' if end.kind.noun == end.kind.channel else end.kind.noun


def _waits(
    context: CheckContext,
    nodes: Sequence[NodeBox],
    channels: Sequence[ChannelBox],
    ids: Mapping[DataPath, str],
) -> Iterator[Wait]:
    known = {node.id for node in nodes} | {channel.id for channel in channels}
    for _, waiter in _specs(context):
        for condition in waiter.wait_for:
            target = _target(waiter, condition)
            if target in known:
                yield Wait(ids[waiter.path], target, condition.path)
    for component in context.spec.components:
        # It is drawn at its container.
        yield Wait(ids[component.path], f'process:{component.container}', component.path)
    for process in context.spec.processes.values():
        for action in process.on_exit:
            if f'process:{action.start}' in known:
                yield Wait(f'process:{action.start}', ids[process.path], action.path)


def _target(waiter: NodeSpec | ProcessSpec | ComponentSpec, condition: ConditionSpec) -> str:
    if condition.kind == 'process':
        return f'process:{condition.name}'
    name = expand_name(condition.name, waiter.name, expand_namespace(waiter.namespace or ''))
    return f'{condition.kind}:{name}'
