"""A checked system → a picture: its nodes, channels and edges, the same for all formats."""

from __future__ import annotations

from dataclasses import fields, replace
from posixpath import commonpath
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.checks.connections.topology import full_name
from composer.checks.connections.wait_conditions import waiters
from composer.checks.placement.crossings import describe_place, place_of
from composer.confidential import conceal, hidden_values
from composer.drawing.delivery import deliveries_of, policies_of
from composer.drawing.finding_places import place_findings
from composer.entity_kinds import CHANNEL_KINDS
from composer.language.qos import (
    BUILTIN_PROFILES,
    DEFAULT_PROFILE,
    INFINITE,
    format_policy_value,
)
from composer.language.specs import ComponentSpec, ProcessSpec
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
    from composer.language.specs import QosSpec
    from composer.yaml_text.positions import DataPath, SourceMap

NodeKind: TypeAlias = Literal['node', 'process']
Side: TypeAlias = Literal['providers', 'users']
Places: TypeAlias = 'Mapping[DataPath, tuple[int, ...]]'

# Policies whose values are clear without their names.
_SELF_EXPLANATORY = ('reliability', 'durability', 'history')


@record
class Box:
    """A node or process, or a topic, service or action.

    Attributes:
        id: Its kind and full name, as in `node:/robot/arm`; no two are the same.
        name: That of a topic, service or action is full.
        namespace: In full, as in `/robot`; of a channel, the deepest one that has all its ends.
        place: The host and the worker that it, or all its ends, run in; empty for those that the
            file names not.
        path: Of a channel, that of the end that is declared first.
        findings: Its findings, as indices into those of the picture.
        types: The types that the ends of a channel declare; more than one is an error.
        external: The sides on which an end is outside the system, by `external: true`.
    """

    id: str
    kind: NodeKind | ChannelKind
    name: str
    namespace: str
    place: Place
    path: DataPath
    findings: tuple[int, ...]
    description: str = ''
    types: tuple[str, ...] = ()
    external: tuple[Side, ...] = ()

    @property
    def title(self) -> str:
        """Its kind and full name."""
        return _title(self.id)

    @property
    def facts(self) -> list[str]:
        """What there is to say of it."""
        place = '' if self.types else describe_place(self.place)
        external = [
            f'external {kind.noun}s'
            for kind in CHANNEL_KINDS
            if kind.channel == self.kind
            and ('providers' if kind.provides else 'users') in self.external
        ]
        return [*filter(None, (self.description, place)), *self.types, *external]


@record
class Edge:
    """A publisher, subscription, server or client: it connects a node with a channel.

    Attributes:
        id: Its kind, the full name of its node, and its name, as in `publisher:/robot/arm:scan`.
        kind: In words, as in `publisher`, `service client` and `service server`.
        node: The id of its node or process.
        channel: The id of its topic, service or action.
        ends: Both, in the direction of messages, requests and goals.
        qos: The policies that differ from the default of ROS; durations in seconds.
        delivery: Which way its messages, calls or goals go.
        by_parameter: The parameters that its name or depth follows, by these keys.
        findings: Its findings, as indices into those of the picture.
    """

    id: str
    kind: str
    name: str
    node: str
    channel: str
    ends: tuple[str, str]
    type: str
    qos: Mapping[str, Any]
    delivery: Delivery
    path: DataPath
    findings: tuple[int, ...]
    by_parameter: Mapping[str, str]

    @property
    def title(self) -> str:
        """Its kind, its name and its node."""
        return f'{self.kind} {self.name} of {_title(self.node)}'

    @property
    def facts(self) -> list[str]:
        """What there is to say of it."""
        qos = self.policies and f'QoS: {self.policies}'
        delivery = self.delivery.way and f'delivery: {self.delivery}'
        return [*filter(None, (self.type, qos, delivery, self.followed))]

    @property
    def policies(self) -> str:
        """The QoS in words, as in `best_effort, depth 5, deadline 0.1 s`."""
        return ', '.join(_describe_policy(key, value) for key, value in self.qos.items())

    @property
    def followed(self) -> str:
        """What follows parameters, in words; empty for nothing."""
        return ', '.join(f'{key} by parameter {name}' for key, name in self.by_parameter.items())


def _title(id_: str) -> str:
    return id_.replace(':', ' ', 1)


def _describe_policy(key: str, value: Any) -> str:
    if key in _SELF_EXPLANATORY and value not in ('system_default', 'best_available'):
        return str(value)
    return f'{key.replace("_", " ")} {format_policy_value(key, value)}'


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
    nodes: tuple[Box, ...]
    channels: tuple[Box, ...]
    edges: tuple[Edge, ...]
    waits: tuple[Wait, ...]
    findings: tuple[Diagnostic, ...]
    positions: SourceMap

    @property
    def parts(self) -> tuple[Box | Edge, ...]:
        """All that may have findings."""
        return (*self.nodes, *self.channels, *self.edges)

    def tokens(self) -> dict[str, str]:
        """Return short names of the parts by their ids: no keyword of a language is like them."""
        kinds: dict[str, Sequence[Box | Edge]]
        kinds = {'n': self.nodes, 'c': self.channels, 'e': self.edges}
        return {
            part.id: f'{letter}{index}'
            for letter, parts in kinds.items()
            for index, part in enumerate(parts)
        }


def build_picture(context: CheckContext, findings: Sequence[Diagnostic]) -> Picture:
    """Return the picture of a system, with the findings at the parts that they are about."""
    places = place_findings(context.system.positions, context.topology, findings)
    nodes = tuple(_nodes(context, places))
    ids = {node.path: node.id for node in nodes}
    channels = tuple(_channels(context.topology, places))
    picture = Picture(
        context.spec.name,
        context.spec.description,
        nodes,
        channels,
        tuple(_edges(context, places, ids)),
        tuple(_waits(context, {*ids.values(), *(channel.id for channel in channels)}, ids)),
        tuple(findings),
        context.system.positions,
    )
    return _concealed(picture, {}) if hidden_values() else picture


def _concealed(value: Any, shown: dict[str, str]) -> Any:
    """Return a part of a picture with the origins of hidden values in their place.

    Args:
        shown: What is shown for each text so far: for those that differ, it does, too.
    """
    if isinstance(value, str):
        if value not in shown:
            text = conceal(value)
            is_taken = text != value and text in shown.values()
            shown[value] = f'{text} {len(shown)}' if is_taken else text
        return shown[value]
    if isinstance(value, tuple):
        return tuple(_concealed(each, shown) for each in value)
    if isinstance(value, Picture | Box | Edge | Wait):
        # By its path a part is found in the file.
        known = {'path', 'findings', 'kind', 'external', 'place', 'positions'}
        names = (each.name for each in fields(value) if each.name not in known)
        return replace(value, **{name: _concealed(getattr(value, name), shown) for name in names})
    return value


def _nodes(context: CheckContext, places: Places) -> Iterator[Box]:
    taken: set[str] = set()
    for node in waiters(context.spec):
        kind: NodeKind = 'process' if isinstance(node, ProcessSpec) else 'node'
        namespace = expand_namespace(node.namespace or '')
        full = join_names(namespace, node.name) if kind == 'node' else node.name
        # Two nodes with one name are an error, and are drawn as two.
        id_ = f'{kind}:{full}'
        while id_ in taken:
            id_ += "'"
        taken.add(id_)
        place = (
            (context.spec.processes[node.container].host, '')
            if isinstance(node, ComponentSpec)
            else (node.host, getattr(node, 'worker', ''))
        )
        found = places.get(node.path, ())
        yield Box(id_, kind, node.name, namespace, place, node.path, found, node.description)


def _channels(topology: Topology, places: Places) -> Iterator[Box]:
    for channel in topology.channels.values():
        ends = channel.ends
        sides: set[Side] = {
            'users' if end.kind.provides else 'providers'
            for end in ends
            if getattr(end.entity, 'external', False)
        }
        yield Box(
            f'{channel.kind}:{channel.name}',
            channel.kind,
            channel.name,
            commonpath(f'/{end.node.namespace.strip("/")}' for end in ends),
            _common_place([place_of(end) for end in ends]),
            ends[0].path,
            places.get((channel.kind, channel.name), ()),
            types=tuple(dict.fromkeys(end.entity.type for end in ends)),
            external=tuple(sorted(sides)),
        )


def _common_place(places: Sequence[Place]) -> Place:
    hosts, workers = ({place[part] for place in places} for part in (0, 1))
    if len(hosts) > 1:
        return '', ''
    return hosts.pop(), workers.pop() if len(workers) == 1 else ''


def _edges(context: CheckContext, places: Places, ids: Mapping[DataPath, str]) -> Iterator[Edge]:
    for channel in context.topology.channels.values():
        deliveries = deliveries_of(channel, context.spec.qos)
        for end in channel.ends:
            # A process may have several nodes; components are drawn apart.
            boxed = end.node.path if end.node.path in ids else end.node.path[:2]
            node = ids[boxed]
            inner = '' if boxed == end.node.path else str(end.node.path[-1])
            owner = '/'.join(filter(None, (node.partition(':')[2], inner)))
            noun = end.kind.noun
            followed = getattr(end.entity, 'by_parameter', {})
            ways = (node, f'{channel.kind}:{channel.name}')
            yield Edge(
                f'{noun}:{owner}:{end.entity.name}',
                f'{noun} server' if noun == channel.kind else noun,
                end.entity.name,
                *ways,
                ways if sends(channel.kind, provides=end.kind.provides) else ways[::-1],
                end.entity.type,
                _differing_policies(end, context.spec.qos),
                deliveries[end.path],
                end.path,
                places.get(end.path, ()),
                {key: value.parameter for key, value in followed.items()},
            )


def _differing_policies(end: Endpoint, profiles: Mapping[str, QosSpec]) -> dict[str, Any]:
    """Return the policies that differ from the profile `default`; none if the QoS is invalid.

    Topics and services have the same defaults (`rmw/qos_profiles.h`).
    """
    policies = policies_of(end, profiles) or {}
    usual = BUILTIN_PROFILES[DEFAULT_PROFILE]
    return {key: value for key, value in policies.items() if value != usual.get(key, INFINITE)}


def sends(channel: str, *, provides: bool) -> bool:
    """Return whether an end sends: publishers send messages, and clients requests and goals."""
    return provides == (channel == 'topic')


def _waits(context: CheckContext, known: set[str], ids: Mapping[DataPath, str]) -> Iterator[Wait]:
    for waiter in waiters(context.spec):
        for condition in waiter.wait_for:
            kind, name = condition.kind, condition.name
            if kind == 'node':
                name = expand_name(name, waiter.name, waiter.namespace or '/')
            elif kind != 'process':
                name = full_name(waiter, kind, name)
            if f'{kind}:{name}' in known:
                yield Wait(ids[waiter.path], f'{kind}:{name}', condition.path)
    for component in context.spec.components:
        # It is drawn at its container.
        yield Wait(ids[component.path], f'process:{component.container}', component.path)
    for process in context.spec.processes.values():
        for action in process.on_exit:
            if f'process:{action.start}' in known:
                yield Wait(f'process:{action.start}', ids[process.path], action.path)
