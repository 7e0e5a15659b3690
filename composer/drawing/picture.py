"""A checked system → a picture: its nodes, channels and edges, the same for all formats."""

from __future__ import annotations

from dataclasses import field, fields, replace
from itertools import count
from posixpath import commonpath
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.checks.connections.topology import full_name
from composer.checks.connections.wait_conditions import waiters
from composer.checks.placement.crossings import describe_place, place_of
from composer.confidential import conceal, hidden_values
from composer.drawing.delivery import OUTSIDE, Delivery, deliveries_of, policies_of
from composer.drawing.finding_places import Marks
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
    from composer.language.specs import QosSpec
    from composer.yaml_text.positions import DataPath, SourceMap

Side: TypeAlias = Literal['providers', 'users']

# Policies whose values are clear without their names.
_SELF_EXPLANATORY = ('reliability', 'durability', 'history')
# What quotes nothing; messages of findings hide values themselves.
_NEVER_HIDDEN = {'token', 'kind', 'role', 'path', 'findings', 'remarks', 'mark'}
_NEVER_HIDDEN |= {'external', 'place'}


@record
class Part:
    """What all parts of a picture have.

    Attributes:
        token: A short name in the drawing: no keyword of a language is like it.
        kind: `node`, `process`, `topic`, `service`, `action` or `external`; of a folded region,
            `folded`; of what waits for something, `wait`. An edge has the kind of its channel.
        details: Smaller lines below the name.
        findings: As indices into those of the picture.
        remarks: The messages of its findings, in lines; each is shown at one part.
        mark: The worst of its findings, `error` or `warning`; empty if it has none.
    """

    token: str
    kind: str
    id: str = ''
    name: str = ''
    details: tuple[str, ...] = ()
    path: DataPath = ()
    findings: tuple[int, ...] = ()
    remarks: tuple[str, ...] = ()
    mark: str = ''


@record
class Box(Part):
    """A node or process, or a topic, service or action, or what is drawn in place of these.

    Attributes:
        id: Its kind and full name, as in `node:/robot/arm`; no two are the same.
        name: That of a topic, service or action is full.
        details: The types that the ends of a channel declare; more than one is an error.
        path: Of a channel, that of the end that is declared first.
        namespace: In full, as in `/robot`; of a channel, the deepest one that has all its ends.
        place: The host and the worker that it, or all its ends, run in; empty for those that the
            file names not.
        external: The sides on which an end is outside the system, by `external: true`.
    """

    namespace: str = '/'
    place: Place = ('', '')
    description: str = ''
    external: tuple[Side, ...] = ()

    @property
    def title(self) -> str:
        """Its kind and full name."""
        return self.id.replace(':', ' ', 1)

    @property
    def facts(self) -> list[str]:
        """What there is to say of it."""
        place = '' if self.details else describe_place(self.place)
        external = [edge.node.name for edge in self.outside]
        return [*filter(None, (self.description, place)), *self.details, *external]

    @property
    def outside(self) -> list[Edge]:
        """A line for each kind of ends outside; all channels share the box of a kind."""
        lines = []
        for kind in CHANNEL_KINDS:
            side = 'providers' if kind.provides else 'users'
            if kind.channel == self.kind and side in self.external:
                token = f'x{kind.channel[0]}{side[0]}'
                box = Box(token, 'external', name=f'external {kind.noun}s')
                start, end = (box, self) if kind.sends else (self, box)
                token = f'x{self.token}{side[0]}'
                lines.append(Edge(token, 'external', start=start, end=end, role=kind.noun))
        return lines


_NOTHING = Box('', '')


@record
class Edge(Part):
    """A publisher, subscription, server or client: it connects a node with a channel.

    Another one is drawn from what is ready to the node or process that waits for it.

    Attributes:
        id: Its role, the full name of its node, and its name, as in `publisher:/robot/arm:scan`.
        start: Where messages, requests and goals come from.
        role: In words, as in `publisher`, `service client` and `service server`; empty for others.
        qos: The policies that differ from the default of ROS; durations in seconds.
        delivery: Which way its messages, calls or goals go.
        by_parameter: The parameters that its name or depth follows, by these keys.
    """

    start: Box = _NOTHING
    end: Box = _NOTHING
    role: str = ''
    type: str = ''
    qos: Mapping[str, Any] = field(default_factory=dict)
    delivery: Delivery = Delivery()
    by_parameter: Mapping[str, str] = field(default_factory=dict)

    @property
    def node(self) -> Box:
        """The end of it that is a node or process, or outside."""
        return self.start if self.start.kind in ('node', 'process', 'external') else self.end

    @property
    def channel(self) -> Box:
        """The end of it that is a topic, service or action."""
        return self.end if self.node is self.start else self.start

    @property
    def title(self) -> str:
        """Its role, its name and its node."""
        return f'{self.role} {self.name} of {self.node.title}'

    @property
    def facts(self) -> list[str]:
        """What there is to say of it."""
        return [self.type, *self.details]


@record
class Picture:
    """A system as it is drawn, in the order of the file."""

    name: str
    description: str
    nodes: tuple[Box, ...]
    channels: tuple[Box, ...]
    edges: tuple[Edge, ...]
    waits: tuple[Edge, ...]
    findings: tuple[Diagnostic, ...]
    positions: SourceMap

    @property
    def parts(self) -> tuple[Box | Edge, ...]:
        """All that may have findings."""
        return (*self.nodes, *self.channels, *self.edges)


def build_picture(context: CheckContext, findings: Sequence[Diagnostic]) -> Picture:
    """Return the picture of a system, with the findings at the parts that they are about."""
    marks = Marks(context.system.positions, context.topology, findings)
    nodes, channels = tuple(_nodes(context, marks)), tuple(_channels(context.topology, marks))
    boxes = {box.id: box for box in (*nodes, *channels)}
    at = {node.path: node for node in nodes}
    edges, waits = tuple(_edges(context, marks, boxes, at)), tuple(_waits(context, boxes, at))
    shown = (context.spec.name, context.spec.description, nodes, channels, edges, waits)
    if hidden_values():
        shown = _concealed(shown, {})
    return Picture(*shown, tuple(findings), context.system.positions)


def _concealed(value: Any, shown: dict[str, str]) -> Any:
    """Return parts of a picture with the origins of hidden values in their place.

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
    if isinstance(value, Part):
        names = (each.name for each in fields(value) if each.name not in _NEVER_HIDDEN)
        return replace(value, **{name: _concealed(getattr(value, name), shown) for name in names})
    return value


def _nodes(context: CheckContext, marks: Marks) -> Iterator[Box]:
    taken: set[str] = set()
    for index, node in enumerate(waiters(context.spec)):
        kind = 'process' if isinstance(node, ProcessSpec) else 'node'
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
        yield Box(
            f'n{index}',
            kind,
            id_,
            node.name,
            path=node.path,
            namespace=namespace,
            place=place,
            description=node.description,
            **marks.at(node.path),
        )


def _channels(topology: Topology, marks: Marks) -> Iterator[Box]:
    for index, channel in enumerate(topology.channels.values()):
        ends = channel.ends
        sides: set[Side] = {
            'users' if end.kind.provides else 'providers'
            for end in ends
            if getattr(end.entity, 'external', False)
        }
        yield Box(
            f'c{index}',
            channel.kind,
            f'{channel.kind}:{channel.name}',
            channel.name,
            details=tuple(dict.fromkeys(end.entity.type for end in ends)),
            path=ends[0].path,
            namespace=commonpath(f'/{end.node.namespace.strip("/")}' for end in ends),
            place=_common_place([place_of(end) for end in ends]),
            external=tuple(sorted(sides)),
            **marks.at((channel.kind, channel.name)),
        )


def _common_place(places: Sequence[Place]) -> Place:
    hosts, workers = ({place[part] for place in places} for part in (0, 1))
    if len(hosts) > 1:
        return '', ''
    return hosts.pop(), workers.pop() if len(workers) == 1 else ''


def _edges(
    context: CheckContext, marks: Marks, boxes: Mapping[str, Box], at: Mapping[DataPath, Box]
) -> Iterator[Edge]:
    tokens = (f'e{index}' for index in count())
    for channel in context.topology.channels.values():
        deliveries = deliveries_of(channel, context.spec.qos)
        for end in channel.ends:
            # A process may have several nodes; components are drawn apart.
            node = at.get(end.node.path) or at[end.node.path[:2]]
            inner = '' if node.path == end.node.path else str(end.node.path[-1])
            owner = '/'.join(filter(None, (node.id.partition(':')[2], inner)))
            ways = (node, boxes[f'{channel.kind}:{channel.name}'])
            if not end.kind.sends:
                ways = ways[::-1]
            noun = end.kind.noun
            qos = _differing_policies(end, context.spec.qos)
            policies = ', '.join(_describe_policy(key, value) for key, value in qos.items())
            parameters = getattr(end.entity, 'by_parameter', {})
            followed = {key: value.parameter for key, value in parameters.items()}
            follows = ', '.join(f'{key} by parameter {name}' for key, name in followed.items())
            delivery = deliveries[end.path]
            # External ends are drawn.
            way = '' if delivery.reason == OUTSIDE else str(delivery)
            yield Edge(
                next(tokens),
                channel.kind,
                f'{noun}:{owner}:{end.entity.name}',
                end.entity.name,
                tuple(filter(None, (policies, way, follows))),
                end.path,
                **marks.at(end.path),
                start=ways[0],
                end=ways[1],
                role=f'{noun} server' if noun == channel.kind else noun,
                type=end.entity.type,
                qos=qos,
                delivery=delivery,
                by_parameter=followed,
            )


def _describe_policy(key: str, value: Any) -> str:
    if key in _SELF_EXPLANATORY and value not in ('system_default', 'best_available'):
        return str(value)
    return f'{key.replace("_", " ")} {format_policy_value(key, value)}'


def _differing_policies(end: Endpoint, profiles: Mapping[str, QosSpec]) -> dict[str, Any]:
    """Return the policies that differ from the profile `default`; none if the QoS is invalid.

    Topics and services have the same defaults (`rmw/qos_profiles.h`).
    """
    policies = policies_of(end, profiles) or {}
    usual = BUILTIN_PROFILES[DEFAULT_PROFILE]
    return {key: value for key, value in policies.items() if value != usual.get(key, INFINITE)}


def _waits(
    context: CheckContext, boxes: Mapping[str, Box], at: Mapping[DataPath, Box]
) -> Iterator[Edge]:
    waits: list[tuple[Box | None, Box | None, DataPath]] = []
    for waiter in waiters(context.spec):
        for condition in waiter.wait_for:
            kind, name = condition.kind, condition.name
            if kind == 'node':
                name = expand_name(name, waiter.name, waiter.namespace or '/')
            elif kind != 'process':
                name = full_name(waiter, kind, name)
            waits.append((boxes.get(f'{kind}:{name}'), at[waiter.path], condition.path))
    waits += [
        (boxes[f'process:{component.container}'], at[component.path], component.path)
        for component in context.spec.components
    ]
    waits += [
        (at[process.path], boxes.get(f'process:{action.start}'), action.path)
        for process in context.spec.processes.values()
        for action in process.on_exit
    ]
    known = [(start, end, path) for start, end, path in waits if start and end]
    for index, (start, end, path) in enumerate(known):
        yield Edge(f'w{index}', 'wait', details=('before',), path=path, start=start, end=end)
