"""The topology of a system: its topics, services and actions by full names, and their ends.

Names are resolved as ROS does: namespaces, private names, then the node's remapping rules. ROS 2
Jazzy does not remap the names of actions, only those of the topics and services they consist of.
"""

from __future__ import annotations

from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, TypeAlias

from composer.ament import remaps_actions
from composer.entity_kinds import (
    CHANNEL_KINDS,
    KIND_OF_NOUN,
    KIND_OF_SECTION,
    ChannelKind,
    EntityKind,
)
from composer.language.specs import DeclaredEndSpec, NodeSpec
from composer.names import expand_name, find_namespace_problem, find_topic_name_problem, remap_name
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import (
        ComponentSpec,
        DeclaredNodeSpec,
        EndSpec,
        ProcessSpec,
        QosSpec,
        SystemSpec,
    )
    from composer.node_uses.reading import CreatedEntity
    from composer.yaml_text.positions import DataPath, SourceMap

# An end that may exist: its channel, whether it provides, and its type, `None` for any.
PossibleEnd: TypeAlias = tuple[ChannelKind, bool, str | None]

# The schemes of the rules for a name; actions, if at all, are remapped as topics are.
_SCHEMES = {'topic': 'rostopic', 'service': 'rosservice', 'action': 'rostopic'}
# What ROS itself and its tools publish or hear (`rosout`, the time source, tf2, diagnostics).
TOPICS_OF_ROS = {
    '/clock': 'rosgraph_msgs/msg/Clock',
    '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray',
    '/diagnostics_agg': 'diagnostic_msgs/msg/DiagnosticArray',
    '/diagnostics_toplevel_state': 'diagnostic_msgs/msg/DiagnosticStatus',
    '/parameter_events': 'rcl_interfaces/msg/ParameterEvent',
    '/rosout': 'rcl_interfaces/msg/Log',
}
# Between the name of an action and those of the topics and services that it consists of.
OF_ACTIONS = '/_action/'
_PARTS_OF_ACTIONS: dict[tuple[ChannelKind, str], str] = {
    ('topic', 'status'): 'action_msgs/msg/GoalStatusArray',
    ('topic', 'feedback'): '{}_FeedbackMessage',
    ('service', 'send_goal'): '{}_SendGoal',
    ('service', 'get_result'): '{}_GetResult',
    ('service', 'cancel_goal'): 'action_msgs/srv/CancelGoal',
}
# By the keys of a node that switch them on, with types (rclpy's `LifecycleNodeMixin`,
# `ParameterService` and the like).
_SERVICES_OF_ROS = {
    'lifecycle': {
        'change_state': 'lifecycle_msgs/srv/ChangeState',
        'get_available_states': 'lifecycle_msgs/srv/GetAvailableStates',
        'get_available_transitions': 'lifecycle_msgs/srv/GetAvailableTransitions',
        'get_state': 'lifecycle_msgs/srv/GetState',
        'get_transition_graph': 'lifecycle_msgs/srv/GetAvailableTransitions',
    },
    'parameter_services': {
        'describe_parameters': 'rcl_interfaces/srv/DescribeParameters',
        'get_parameter_types': 'rcl_interfaces/srv/GetParameterTypes',
        'get_parameters': 'rcl_interfaces/srv/GetParameters',
        'list_parameters': 'rcl_interfaces/srv/ListParameters',
        'set_parameters': 'rcl_interfaces/srv/SetParameters',
        'set_parameters_atomically': 'rcl_interfaces/srv/SetParametersAtomically',
    },
    'type_description_service': {
        'get_type_description': 'type_description_interfaces/srv/GetTypeDescription',
    },
    'logger_services': {
        'get_logger_levels': 'rcl_interfaces/srv/GetLoggerLevels',
        'set_logger_levels': 'rcl_interfaces/srv/SetLoggerLevels',
    },
}


@record
class Endpoint:
    """One end of a channel: that of a node, or one that an external process declares."""

    node: NodeSpec | DeclaredNodeSpec
    entity: EndSpec | DeclaredEndSpec
    kind: EntityKind

    @property
    def is_declared(self) -> bool:
        """Whether it is an end of an external process."""
        return isinstance(self.entity, DeclaredEndSpec)

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
        return written_name(self.entity, self.kind)

    @property
    def owner(self) -> str:
        """Return `node 'lidar'`, or `process 'lidar'`."""
        if isinstance(self.node, NodeSpec):
            return f"node '{self.node.name}'"
        is_own = self.node.path[-1] == self.node.process
        return f"process '{self.node.process}'" if is_own else f"node '{self.node.name}'"

    def __str__(self) -> str:
        """Return `publisher 'scan' of node 'lidar'`."""
        return f"{self.kind.noun} '{self.entity.name}' of {self.owner}"


def written_name(entity: EndSpec | DeclaredEndSpec, kind: EntityKind) -> str:
    """Return the name of the topic, service or action of an end, as the file has it."""
    key = 'channel' if isinstance(entity, DeclaredEndSpec) else str(kind.channel)
    return str(getattr(entity, key))


@record
class Channel:
    """A topic, service or action, and its ends.

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


@record
class Topology:
    """All channels of a system.

    Attributes:
        ros_services: The services that ROS itself gives to the nodes: their types by full names.
        possible: Ends that channels may have as well: their names depend on an argument that is
            not given yet, or they are missing or misnamed because of another error.
        created: The channels of ends that behaviours create, and whether these provide.
        left_out: The channels of nodes and entities that are left out by their `when`.
    """

    channels: dict[tuple[ChannelKind, str], Channel]
    ros_services: Mapping[str, str]
    possible: frozenset[PossibleEnd]
    left_out: frozenset[tuple[ChannelKind, str]]
    created: set[tuple[ChannelKind, str, bool]] = field(default_factory=set)

    def of_kind(self, kind: ChannelKind) -> Iterator[Channel]:
        """Yield the channels of a kind."""
        return (channel for channel in self.channels.values() if channel.kind == kind)

    def type_of_ros(self, channel: Channel) -> str | None:
        """Return the type that ROS gives to a topic or service of its own, `None` to others."""
        if channel.kind == 'topic' and channel.name in TOPICS_OF_ROS:
            return TOPICS_OF_ROS[channel.name]
        if channel.kind == 'service' and channel.name in self.ros_services:
            return self.ros_services[channel.name]
        owner, separator, part = channel.name.partition(OF_ACTIONS)
        form = _PARTS_OF_ACTIONS.get((channel.kind, part)) if separator else None
        action = self.channels.get(('action', owner))
        if form is None or (action is None and '{' in form):
            return None
        return form.format(action.ends[0].entity.type if action else '')

    def is_served_by_ros(self, channel: Channel) -> bool:
        """Return whether ROS serves a service for a node or an action of the system."""
        owner, separator, _ = channel.name.partition(OF_ACTIONS)
        action = self.channels.get(('action', owner)) if separator else None
        return channel.name in self.ros_services or bool(action and action.providers)

    def may_have_more(self, channel: Channel, type_name: str | None = None) -> bool:
        """Return whether the end that a channel lacks may be one of the possible ones.

        Args:
            type_name: Its type, where the channel has no end at all.
        """
        is_provider = not channel.providers
        if (channel.kind, channel.name, is_provider) in self.created:
            return True
        types = (None, type_name, *(end.entity.type for end in channel.ends))
        return any((channel.kind, is_provider, type_) in self.possible for type_ in types)


def add_created(topology: Topology, node: NodeSpec, created: Iterable[CreatedEntity]) -> Topology:
    """Return a topology with what a behaviour of a node creates."""
    possible = set(topology.possible)
    for each in created:
        kind = KIND_OF_NOUN[each.kind]
        if kind.channel is None:
            continue
        if each.channel is None:
            possible.add((kind.channel, kind.provides, each.type))
        else:
            name = full_name(node, kind.channel, each.channel)
            topology.created.add((kind.channel, name, kind.provides))
    return replace(topology, possible=frozenset(possible))


def build_topology(
    system: LoadedSystem,
    spec: SystemSpec,
    has_real_type: Callable[[EndSpec | DeclaredEndSpec], bool],
) -> Topology:
    """Return the topology of a system.

    Args:
        has_real_type: Returns whether the type of an entity is the one that is meant.
    """
    uncertain = _UncertainNames(system, spec)
    channels: dict[tuple[ChannelKind, str], Channel] = {}
    possible: set[PossibleEnd] = set(uncertain.missing)
    for node, kind, channel_kind, entity in _ends(spec.end_owners()):
        name = written_name(entity, kind)
        if uncertain.has(node, entity.path, channel_kind):
            possible.add((channel_kind, kind.provides, None))
            continue
        if name.startswith('~') and not (isinstance(node, NodeSpec) or node.is_named):
            possible.add((channel_kind, kind.provides, entity.type))
            continue
        # Without a type, too, it would be a reason to say nothing of any other.
        if is_misnamed(system.positions, node, name) and has_real_type(entity):
            possible.add((channel_kind, kind.provides, entity.type))
        key = channel_kind, full_name(node, channel_kind, name)
        channel = channels.setdefault(key, Channel(*key))
        ends = channel.providers if kind.provides else channel.users
        ends.append(Endpoint(node, entity, kind))
    services = dict(each for node in spec.nodes.values() for each in _services_of_ros(node))
    unused = system.unused.end_owners() if system.unused else ()
    used = {node.path: node for node in spec.nodes.values()}
    left_out = (
        (channel_kind, full_name(node, channel_kind, written_name(entity, kind)))
        for node, kind, channel_kind, entity in _ends(unused)
        if node.path not in used or entity.name not in getattr(used[node.path], kind.section)
    )
    return Topology(channels, services, frozenset(possible), frozenset(left_out))


def _ends(
    nodes: Iterable[NodeSpec | DeclaredNodeSpec],
) -> Iterator[
    tuple[NodeSpec | DeclaredNodeSpec, EntityKind, ChannelKind, EndSpec | DeclaredEndSpec]
]:
    for node in nodes:
        for kind, entity in node.ends():
            if kind.channel:
                yield node, kind, kind.channel, entity


def _is_bad_rule(rule: tuple[str, str]) -> bool:
    source, target = rule
    return _is_no_name(source.rpartition('://')[2], target)


def is_misnamed(positions: SourceMap, node: NodeSpec | DeclaredNodeSpec, name: str) -> bool:
    """Return whether ROS refuses a name, or the namespace that this node alone has."""
    if _is_no_name(name):
        return True
    spans = positions.values
    own = spans.get((*node.path[:_DEPTH_OF_SECTIONS], 'namespace'))
    is_own = own is not None and own != spans.get(('defaults', 'namespace'))
    return is_own and find_namespace_problem(node.namespace) is not None


def _is_no_name(*names: str) -> bool:
    return any(find_topic_name_problem(name) for name in names)


def full_name(
    node: NodeSpec | DeclaredNodeSpec | ProcessSpec | ComponentSpec,
    kind: ChannelKind,
    name: str,
) -> str:
    """Return the full name of a topic, service or action of a node or process."""
    namespace = node.namespace or '/'
    full = expand_name(name, node.name, namespace)
    if not node.remap or (kind == 'action' and not remaps_actions()):
        return full
    return remap_name(full, node.remap, node.name, namespace, _SCHEMES[kind])


def _services_of_ros(node: NodeSpec) -> Iterator[tuple[str, str]]:
    for key, services in _SERVICES_OF_ROS.items():
        if getattr(node, key):
            for name, type_name in services.items():
                yield expand_name(f'~/{name}', node.name, node.namespace), type_name


class _UncertainNames:
    """Names that are not the real ones: samples, and what stands in for something wrong.

    Attributes:
        missing: The ends that may be missing because data were dropped.
    """

    def __init__(self, system: LoadedSystem, spec: SystemSpec) -> None:
        positions = system.positions
        sampled = set(system.sampled)
        paths = {
            path
            for spans in ((positions.keys, positions.values) if sampled else ())
            for path, span in spans.items()
            if span in sampled
        }
        self._paths = paths | system.dropped
        self.missing = {
            end
            for path in system.dropped
            if path[:1] == ('include',)
            or (path[:1] in _OWNERS and len(path) <= _DEPTH_OF_ENTITIES + _depth_of(path))
            for end in _ends_lost_with(path)
        }
        self._nodes = {
            path[:_DEPTH_OF_SECTIONS]
            for path in self._paths
            if path[:1] in _OWNERS and len(path) > 1 and _moves_node(path)
        }
        self._misruled = {
            node.path for node in spec.end_owners() if any(map(_is_bad_rule, node.remap))
        }
        self._all = ('defaults', 'namespace') in self._paths or ('defaults',) in self._paths

    def has(self, node: NodeSpec | DeclaredNodeSpec, entity: DataPath, kind: str) -> bool:
        """Return whether the name of an entity is not known for certain."""
        if kind in _SCHEMES and node.path in self._misruled:
            return True
        if not self._paths:
            return False
        return (
            self._all
            or node.path[:_DEPTH_OF_SECTIONS] in self._nodes
            or entity in self._paths
            or (*entity, kind) in self._paths
        )


_OWNERS = (('nodes',), ('processes',))
# Where the nodes of a process stand, and what may bring any end.
_INNER = (('nodes',), ('components',))
_OPEN = ('nodes', 'components', 'interface')
# Of the paths of `nodes: {<name>: {<section>: {<entity>: …}}}`.
_DEPTH_OF_SECTIONS = 2
_DEPTH_OF_ENTITIES = 4
_WITHOUT_CHANNELS = {each.name for each in fields(NodeSpec)} - {
    *(kind.section for kind in CHANNEL_KINDS),
    'namespace',
    'remap',
}


def _depth_of(path: DataPath) -> int:
    """Return how much deeper the sections are for a node of a process."""
    return 2 if path[0] == 'processes' and path[2:3] in _INNER else 0


def _ends_lost_with(path: DataPath) -> set[PossibleEnd]:
    """Return the ends that may be missing because the data at a path are."""
    depth = _DEPTH_OF_SECTIONS + _depth_of(path)
    section = str(path[depth]) if len(path) > depth else ''
    if section in _WITHOUT_CHANNELS and path[0] != 'include':
        return set()
    if path[0] == 'processes' and section and section not in (*KIND_OF_SECTION, *_OPEN):
        return set()
    # An unknown key may be any section, misspelt.
    known = KIND_OF_SECTION.get(section)
    kinds = [known] if known else CHANNEL_KINDS
    return {(kind.channel, kind.provides, None) for kind in kinds if kind.channel}


def _moves_node(path: DataPath) -> bool:
    """Return whether the value at a path changes all names of its node."""
    return len(path) <= _DEPTH_OF_SECTIONS or path[_DEPTH_OF_SECTIONS] in ('namespace', 'remap')
