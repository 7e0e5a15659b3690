"""Who meets whom: all publishers, subscriptions, servers and clients by their full names.

Names are resolved as ROS does: namespaces, private names, then the node's remapping rules. ROS 2
Jazzy does not remap the names of actions, only those of the topics and services they consist of.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.language.specs import NodeSpec
from composer.names import expand_name, find_namespace_fault, find_topic_name_fault, remap_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.language.specs import EndSpec, ProcessSpec, QosSpec, SystemSpec
    from composer.yaml_text.positions import DataPath

ChannelKind: TypeAlias = Literal['topic', 'service', 'action']
# An end that may be there: its kind, whether it provides, and its type, `None` for any.
Doubt: TypeAlias = tuple[ChannelKind, bool, str | None]

# By the sections of a node: what meets under one name, and the entity in words.
_SECTIONS: dict[str, tuple[ChannelKind, str]] = {
    'publishers': ('topic', 'publisher'),
    'subscriptions': ('topic', 'subscription'),
    'services': ('service', 'service'),
    'service_clients': ('service', 'service client'),
    'actions': ('action', 'action'),
    'action_clients': ('action', 'action client'),
}
_PROVIDING = ('publishers', 'services', 'actions')
_SCHEMES = {'topic': 'rostopic', 'service': 'rosservice'}
# By the keys of a node that switch them on (rclpy's `ParameterService` and the like).
_SERVICES_OF_ROS = {
    'parameter_services': (
        'describe_parameters',
        'get_parameter_types',
        'get_parameters',
        'list_parameters',
        'set_parameters',
        'set_parameters_atomically',
    ),
    'type_description_service': ('get_type_description',),
    'logger_services': ('get_logger_levels', 'set_logger_levels'),
}


@dataclass(frozen=True, slots=True)
class Endpoint:
    """One end of a channel.

    Attributes:
        noun: Its kind in words, as in `service client`.
    """

    node: NodeSpec
    entity: EndSpec
    noun: str

    @property
    def path(self) -> DataPath:
        """Where it is declared."""
        return self.entity.path

    @property
    def qos(self) -> QosSpec | None:
        """The QoS as declared; actions have none."""
        return getattr(self.entity, 'qos', None)

    @property
    def written(self) -> str:
        """The name of the channel as the file has it."""
        kind = 'topic' if self.noun in ('publisher', 'subscription') else self.noun.split()[0]
        return str(getattr(self.entity, kind))

    def __str__(self) -> str:
        """Return `publisher 'scan' of node 'lidar'`."""
        return f"{self.noun} '{self.entity.name}' of node '{self.node.name}'"


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic, service or action, and who meets there.

    Attributes:
        providers: Its publishers, or its servers.
        users: Its subscriptions, or its clients.
    """

    kind: ChannelKind
    name: str
    providers: list[Endpoint] = field(default_factory=list)
    users: list[Endpoint] = field(default_factory=list)

    @property
    def ends(self) -> list[Endpoint]:
        """All ends."""
        return [*self.providers, *self.users]


@dataclass(frozen=True, slots=True)
class Graph:
    """All channels of a system.

    Attributes:
        of_ros: The full names of the services that ROS itself gives to the nodes.
        doubts: The ends that channels may have beside: their names hang on an argument that is
            not given yet, or they are missing or misnamed for a fault of their own.
        left_out: What nodes have that are left out by their `when`.
    """

    channels: dict[tuple[ChannelKind, str], Channel]
    of_ros: frozenset[str]
    doubts: frozenset[Doubt]
    left_out: frozenset[tuple[ChannelKind, str]]

    def of_kind(self, kind: ChannelKind) -> Iterator[Channel]:
        """Yield the channels of a kind."""
        return (channel for channel in self.channels.values() if channel.kind == kind)

    def may_have_more(self, channel: Channel) -> bool:
        """Return whether the end that a channel lacks may be one that nobody knows."""
        is_provider = not channel.providers
        types = (None, *(end.entity.type for end in channel.ends))
        return any((channel.kind, is_provider, type_) in self.doubts for type_ in types)


def build_graph(context: CheckContext) -> Graph:
    """Return who meets whom in a system."""
    doubts = _Doubts(context)
    channels: dict[tuple[ChannelKind, str], Channel] = {}
    unsure: set[Doubt] = set(doubts.lacking)
    for node, section, entity in _entities(context.spec):
        kind, noun = _SECTIONS[section]
        provides = section in _PROVIDING
        if doubts.about_name(node, entity.path, kind):
            unsure.add((kind, provides, None))
            continue
        name = full_name(node, kind, getattr(entity, kind))
        # Without a type, too, it would be a reason to say nothing of any other.
        if is_doubtful(context, node, getattr(entity, kind)) and context.has_real_type(entity):
            unsure.add((kind, provides, entity.type))
        channel = channels.setdefault((kind, name), Channel(kind, name))
        ends = channel.providers if provides else channel.users
        ends.append(Endpoint(node, entity, noun))
    of_ros = (name for node in context.spec.nodes.values() for name in _services_of_ros(node))
    return Graph(
        channels, frozenset(of_ros), frozenset(unsure), frozenset(_channels_left_out(context))
    )


def _entities(spec: SystemSpec) -> Iterator[tuple[NodeSpec, str, EndSpec]]:
    for node in spec.nodes.values():
        for section in _SECTIONS:
            for entity in getattr(node, section).values():
                yield node, section, entity


def _is_bad_rule(rule: tuple[str, str]) -> bool:
    source, target = rule
    return _is_misnamed(source.rpartition('://')[2], target)


def is_doubtful(context: CheckContext, node: NodeSpec, name: str) -> bool:
    """Return whether a name, or the namespace that this node alone has, is none of ROS."""
    if _is_misnamed(name):
        return True
    spans = context.system.positions.values
    own = spans.get((*node.path, 'namespace'))
    is_own = own is not None and own != spans.get(('defaults', 'namespace'))
    return is_own and find_namespace_fault(node.namespace) is not None


def _is_misnamed(*names: str) -> bool:
    return any(find_topic_name_fault(name) for name in names)


def _channels_left_out(context: CheckContext) -> Iterator[tuple[ChannelKind, str]]:
    unused = context.system.unused
    for node, section, entity in _entities(unused) if unused else ():
        kind, _ = _SECTIONS[section]
        yield kind, full_name(node, kind, getattr(entity, kind))


def full_name(node: NodeSpec | ProcessSpec, kind: ChannelKind, name: str) -> str:
    """Return the name of a topic, service or action of a node or process as others see it."""
    namespace = node.namespace or '/'
    full = expand_name(name, node.name, namespace)
    if not node.remap or kind not in _SCHEMES:
        return full
    return remap_name(full, node.remap, node.name, namespace, _SCHEMES[kind])


def _services_of_ros(node: NodeSpec) -> Iterator[str]:
    for key, names in _SERVICES_OF_ROS.items():
        if getattr(node, key):
            yield from (expand_name(f'~/{name}', node.name, node.namespace) for name in names)


class _Doubts:
    """Which names are not the real ones: samples, and what stands in for something wrong."""

    def __init__(self, context: CheckContext) -> None:
        positions = context.system.positions
        sampled = set(context.system.sampled)
        paths = {
            path
            for spans in ((positions.keys, positions.values) if sampled else ())
            for path, span in spans.items()
            if span in sampled
        }
        self._paths = paths | context.system.dropped
        self.lacking = {
            doubt
            for path in context.system.dropped
            if path[:1] == ('include',)
            or (path[:1] == ('nodes',) and len(path) <= _DEPTH_OF_ENTITIES)
            for doubt in _doubts_about(path)
        }
        self._nodes = {
            path[1]
            for path in self._paths
            if path[:1] == ('nodes',) and len(path) > 1 and _moves_node(path)
        }
        self._misruled = {
            node.path[-1]
            for node in context.spec.nodes.values()
            if any(map(_is_bad_rule, node.remap))
        }
        self._all = ('defaults', 'namespace') in self._paths or ('defaults',) in self._paths

    def about_name(self, node: NodeSpec, entity: DataPath, kind: str) -> bool:
        """Return whether an entity may have another name than it seems."""
        if kind in _SCHEMES and node.path[-1] in self._misruled:
            return True
        if not self._paths:
            return False
        return (
            self._all
            or node.path[-1] in self._nodes
            or entity in self._paths
            or (*entity, kind) in self._paths
        )


# Of the paths of `nodes: {<name>: {<section>: {<entity>: …}}}`.
_DEPTH_OF_SECTIONS = 2
_DEPTH_OF_ENTITIES = 4
_WITHOUT_CHANNELS = {each.name for each in fields(NodeSpec)} - {
    *_SECTIONS,
    'namespace',
    'remap',
}


def _doubts_about(path: DataPath) -> set[Doubt]:
    """Return what ends may be missing without the data at a path."""
    section = str(path[_DEPTH_OF_SECTIONS]) if len(path) > _DEPTH_OF_SECTIONS else ''
    if section in _WITHOUT_CHANNELS and path[0] == 'nodes':
        return set()
    # An unknown key may be any section, misspelt.
    sections = [section] if section in _SECTIONS else list(_SECTIONS)
    return {(_SECTIONS[each][0], each in _PROVIDING, None) for each in sections}


def _moves_node(path: DataPath) -> bool:
    """Return whether what is at a path has a say in all names of its node."""
    return len(path) <= _DEPTH_OF_SECTIONS or path[_DEPTH_OF_SECTIONS] in ('namespace', 'remap')
