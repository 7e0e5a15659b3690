"""What the nodes on the ROS graph have: their ends with types and QoS, and their parameters."""

from __future__ import annotations

import re
import time
from collections import Counter
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from rclpy.node import NodeNameNonExistentError
from rclpy.parameter import parameter_value_to_python

from composer.language.qos import BUILTIN_PROFILES, DEFAULT_PROFILE, DURATIONS, NANOSECONDS
from composer.names import join_names
from composer.records import record
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from rclpy.executors import Executor
    from rclpy.node import Node as RosNode
    from rclpy.qos import QoSProfile

_POLL_SEC = 0.1
# The graph is complete when nothing was new for so long.
_SETTLED_SEC = 1.5
_LONGEST_SEARCH_SEC = 10.0
# Something that is lacking may still come for so long after the last that was new.
_PATIENCE_SEC = 5.0
# So many nodes are asked at the same time.
_ASKED_AT_ONCE = 16
_TOPICS_OF_EVERY_NODE = ('/rosout', '/parameter_events')
_SERVICES_OF_EVERY_NODE = (
    *('describe_parameters', 'get_parameter_types', 'get_parameters', 'list_parameters'),
    *('set_parameters', 'set_parameters_atomically', 'get_type_description'),
    *('get_logger_levels', 'set_logger_levels'),
)
_PARAMETERS_OF_EVERY_NODE = ('use_sim_time', 'start_type_description_service')
_QOS_OVERRIDES = 'qos_overrides.'
# Of an action, as in `/move/_action/send_goal` of the type `pkg/action/Move_SendGoal`.
_GOALS, _GOAL_TYPE = '/_action/send_goal', '_SendGoal'
_TYPES = {
    getattr(ParameterType, f'PARAMETER_{name.upper()}'): name
    for scalar in ('bool', 'integer', 'double', 'string')
    for name in (scalar, f'{scalar}_array')
} | {ParameterType.PARAMETER_BYTE_ARRAY: 'byte_array'}
# `ros2 launch` has a node of its own; those of other tools begin with an underscore.
_OF_TOOLS = re.compile(r'_|launch_ros_\d+$')
# DDS says infinite with the largest number of seconds that it has.
_INFINITE_SEC = 2**31 - 1
# Longer texts, as descriptions of robots are, say nothing about the node.
_LONGEST_TEXT = 200


@record
class CapturedEnd:
    """A publisher, client, ...

    Attributes:
        channel: The full name of its topic, service or action.
        qos: The policies that differ from the defaults, by the keys of the language.
        is_alone: Whether nobody is at the other end.
    """

    channel: str
    type: str
    qos: Mapping[str, Any]
    is_alone: bool


@record
class CapturedNode:
    """A node on the graph.

    Attributes:
        sections: Its ends by the sections of a node.
        parameters: Their declarations in the language, by name; `None` if they are not known.
        is_silent: Whether it was asked for its parameters, and did not answer.
        problem: Why something of it is missing; empty if nothing is.
    """

    name: str
    namespace: str
    sections: Mapping[str, Sequence[CapturedEnd]]
    parameters: Mapping[str, Mapping[str, Any]] | None
    is_silent: bool
    problem: str

    @property
    def full_name(self) -> str:
        """Its name in its namespace."""
        return join_names(self.namespace, self.name)


class NodesNotFoundError(Exception):
    """Nodes are not on the graph; `args` are the message and the help."""


def capture_nodes(
    node: RosNode, executor: Executor, wanted: Sequence[str], timeout_sec: float
) -> list[CapturedNode]:
    """Return what nodes have, by their full names.

    Args:
        node: A node that can ask the graph; it is left out.
        executor: The one that the node is in.
        wanted: Full names, or names in any namespace; all nodes if there are none.
        timeout_sec: How long nodes may take to answer.

    Raises:
        NodesNotFoundError: A node is not there, or none is.
    """
    graph = _find_graph(node, wanted)
    names = graph.choose(wanted)
    asked = [name for name in names if f'{name}/list_parameters' in graph.servers.get(name, {})]
    answers: dict[str, dict[str, dict[str, Any]] | None] = {}
    for start in range(0, len(asked), _ASKED_AT_ONCE):
        batch = asked[start : start + _ASKED_AT_ONCE]
        answers |= _ParameterReader(node, executor, timeout_sec).read(batch)
    return [graph.describe(name, answers, timeout_sec) for name in names]


def _find_graph(node: RosNode, wanted: Sequence[str]) -> _Graph:
    """Return the graph as soon as it has all that is wanted, and nothing new comes."""
    begun = settled = time.monotonic()
    graph = _Graph(node)
    while True:
        time.sleep(_POLL_SEC)
        latest, now = _Graph(node), time.monotonic()
        if latest.shape != graph.shape:
            graph, settled = latest, now
        is_complete = graph.names and not graph.lacking(wanted) and not graph.has_unknown
        patience = _SETTLED_SEC if is_complete else _PATIENCE_SEC
        if now - settled > patience or now - begun > _LONGEST_SEARCH_SEC:
            return latest


class _Graph:
    """The graph at a time.

    Attributes:
        names: The full names of the nodes with their names and namespaces.
        repeated: Those that several nodes have.
        topics: By full names of nodes, the sections and ends.
        servers: By full names of nodes, the services that they serve, with their types.
        clients: The same for those that they call.
        has_unknown: Whether the node of an end is not known yet.
        shape: What tells apart two graphs.
    """

    def __init__(self, node: RosNode) -> None:
        own = join_names(node.get_namespace(), node.get_name())
        present = sorted(node.get_node_names_and_namespaces())
        self.names = {
            join_names(namespace, name): (name, namespace) for name, namespace in present
        }
        often = Counter(join_names(namespace, name) for name, namespace in present)
        self.repeated = {full for full, count in often.items() if count > 1}
        self.names.pop(own, None)
        self.topics: dict[str, list[tuple[str, CapturedEnd]]] = {}
        self.has_unknown = False
        for topic, _ in sorted(node.get_topic_names_and_types()):
            if not _is_hidden(topic) and topic not in _TOPICS_OF_EVERY_NODE:
                self._add_topic(node, topic)
        self.servers = self._list(node.get_service_names_and_types_by_node)
        self.clients = self._list(node.get_client_names_and_types_by_node)
        self.shape = repr((self.names, self.topics, self.servers, self.clients))

    def _add_topic(self, node: RosNode, topic: str) -> None:
        sides = {
            'publishers': node.get_publishers_info_by_topic(topic),
            'subscriptions': node.get_subscriptions_info_by_topic(topic),
        }
        for section, ends in sides.items():
            other = sides['subscriptions' if section == 'publishers' else 'publishers']
            for end in ends:
                owner = join_names(end.node_namespace, end.node_name)
                self.has_unknown |= owner not in self.names
                qos = _differing(end.qos_profile)
                found = CapturedEnd(topic, end.topic_type, qos, not other)
                self.topics.setdefault(owner, []).append((section, found))

    def _list(
        self, list_names: Callable[[str, str], Iterable[tuple[str, list[str]]]]
    ) -> dict[str, dict[str, str]]:
        """Return services and their types by the full names of nodes."""
        found: dict[str, dict[str, str]] = {}
        for full, (name, namespace) in self.names.items():
            try:
                services = sorted(list_names(name, namespace))
            except NodeNameNonExistentError:
                # It has ended since.
                continue
            found[full] = {service: types[0] for service, types in services if types}
        return found

    def lacking(self, wanted: Iterable[str]) -> list[str]:
        """Return the names that no node has."""
        return [name for name in wanted if not self._matching(name)]

    def choose(self, wanted: Sequence[str]) -> list[str]:
        """Return the full names of the nodes that are wanted; those of tools only if named."""
        shown = [
            full
            for full, (name, space) in self.names.items()
            # A system has a hidden node, and beside it one that answers as a container does.
            if not _OF_TOOLS.match(name) and join_names(space, f'_{name}') not in self.names
        ]
        if not wanted:
            if not shown:
                message = 'there are no nodes on this ROS graph'
                raise NodesNotFoundError(message, 'start what is to be captured first')
            return shown
        for name in self.lacking(wanted):
            message = f"there is no node '{name}' on this ROS graph"
            last_names = [full.rpartition('/')[2] for full in shown]
            listed = suggest(name, shown, 'there are', 'there are none')
            help_text = did_you_mean(find_nearest(name, last_names), listed)
            raise NodesNotFoundError(message, help_text)
        return list(dict.fromkeys(full for name in wanted for full in self._matching(name)))

    def _matching(self, name: str) -> list[str]:
        return [full for full in self.names if name == full or full.endswith(f'/{name}')]

    def describe(
        self,
        full: str,
        answers: Mapping[str, Mapping[str, Mapping[str, Any]] | None],
        timeout_sec: float,
    ) -> CapturedNode:
        """Return a node with its parameters, if it has answered."""
        sections: dict[str, list[CapturedEnd]] = {}
        for section, end in (*self.topics.get(full, ()), *self._services_of(full)):
            ends = sections.setdefault(section, [])
            if end not in ends:
                ends.append(end)
        name, namespace = self.names[full]
        is_silent = full in answers and answers[full] is None
        problem = ''
        if full in self.repeated:
            problem = 'several nodes have this name: what they have is mixed up'
        elif full not in answers:
            problem = 'it has no parameter services: its parameters are not known'
        elif is_silent:
            problem = f'it did not answer within {timeout_sec:g} s: its parameters are not known'
        return CapturedNode(name, namespace, sections, answers.get(full), is_silent, problem)

    def _services_of(self, full: str) -> Iterator[tuple[str, CapturedEnd]]:
        sides = (
            ('services', 'actions', self.servers, self.clients),
            ('service_clients', 'action_clients', self.clients, self.servers),
        )
        own = {f'{full}/{name}' for name in _SERVICES_OF_EVERY_NODE}
        for services, actions, ends, others in sides:
            at_other_end = {name for each in others.values() for name in each}
            for name, kind in ends.get(full, {}).items():
                is_alone = name not in at_other_end
                if name.endswith(_GOALS) and kind.endswith(_GOAL_TYPE):
                    action, of_action = name.removesuffix(_GOALS), kind.removesuffix(_GOAL_TYPE)
                    yield actions, CapturedEnd(action, of_action, {}, is_alone)
                elif not _is_hidden(name) and not (services == 'services' and name in own):
                    # Nobody declares the services that each node has.
                    is_common = name.rpartition('/')[2] in _SERVICES_OF_EVERY_NODE
                    yield services, CapturedEnd(name, kind, {}, is_alone or is_common)


def _is_hidden(name: str) -> bool:
    return '/_' in name


def _differing(profile: QoSProfile) -> dict[str, Any]:
    """Return the policies of an end that differ from the defaults; what is not known does not."""
    defaults = BUILTIN_PROFILES[DEFAULT_PROFILE] | {'liveliness': 'automatic'}
    found: dict[str, Any] = {}
    for policy in ('history', 'reliability', 'durability', 'liveliness'):
        value = getattr(profile, policy).name.lower()
        if value not in ('unknown', 'system_default', defaults[policy]):
            found[policy] = value
    is_kept = getattr(profile, 'history').name.lower() == 'keep_last'  # noqa: B009 - as above
    if is_kept and profile.depth not in (0, defaults['depth']):
        found['depth'] = profile.depth
    for policy in DURATIONS:
        seconds = getattr(profile, policy).nanoseconds / NANOSECONDS
        if 0 < seconds < _INFINITE_SEC:
            found[policy] = seconds
    return found


class _ParameterReader:
    """Asks nodes for their parameters, all at the same time."""

    def __init__(self, node: RosNode, executor: Executor, timeout_sec: float) -> None:
        self._node = node
        self._executor = executor
        self._timeout_sec = timeout_sec

    def read(self, names: Collection[str]) -> dict[str, dict[str, dict[str, Any]] | None]:
        """Return declarations by the full names of nodes; `None` of those that do not answer."""
        request = ListParameters.Request(depth=ListParameters.Request.DEPTH_RECURSIVE)
        listed = self._ask('list_parameters', ListParameters, dict.fromkeys(names, request))
        found = {name: _own(answer.result.names) for name, answer in listed.items()}
        describing = {name: DescribeParameters.Request(names=each) for name, each in found.items()}
        described = self._ask('describe_parameters', DescribeParameters, describing)
        getting = {name: GetParameters.Request(names=each) for name, each in found.items()}
        values = self._ask('get_parameters', GetParameters, getting)
        return {
            name: _declarations(found[name], described[name].descriptors, values[name].values)
            if name in described and name in values
            else None
            for name in names
        }

    def _ask(self, service: str, kind: Any, requests: Mapping[str, Any]) -> dict[str, Any]:
        """Return the answers of the nodes that answer in time."""
        clients = {name: self._node.create_client(kind, f'{name}/{service}') for name in requests}
        deadline = time.monotonic() + self._timeout_sec
        try:
            calls: dict[str, Any] = {}
            for name, client in clients.items():
                if client.wait_for_service(max(0.0, deadline - time.monotonic())):
                    calls[name] = client.call_async(requests[name])
            for call in calls.values():
                left_sec = max(0.0, deadline - time.monotonic())
                self._executor.spin_until_future_complete(call, left_sec)
            return {name: call.result() for name, call in calls.items() if call.done()}
        finally:
            for client in clients.values():
                self._node.destroy_client(client)


def _own(names: Iterable[str]) -> list[str]:
    """Return the parameters that not every node has."""
    common = _PARAMETERS_OF_EVERY_NODE
    return sorted(
        name for name in names if name not in common and not name.startswith(_QOS_OVERRIDES)
    )


def _declarations(
    names: Sequence[str], descriptors: Sequence[Any], values: Sequence[Any]
) -> dict[str, dict[str, Any]]:
    """Return declarations in the language by the names of parameters.

    One without a value and a type has neither in it; one whose type may change has no type.
    """
    found: dict[str, dict[str, Any]] = {}
    if not len(names) == len(descriptors) == len(values):
        return found
    for name, descriptor, value in zip(names, descriptors, values, strict=True):
        type_name = _TYPES.get(descriptor.type) or _TYPES.get(value.type)
        declared: dict[str, Any] = {} if type_name is None else {'type': type_name}
        if value.type in _TYPES and type_name != 'byte_array':
            plain = parameter_value_to_python(value)
            plain = plain if isinstance(plain, bool | int | float | str) else list(plain)
            if not (isinstance(plain, str) and len(plain) > _LONGEST_TEXT):
                declared['default'] = plain
        if descriptor.description:
            declared['description'] = descriptor.description
        if descriptor.read_only:
            declared['read_only'] = True
        found[name] = declared | _range_of(descriptor)
    return found


def _range_of(descriptor: Any) -> dict[str, Any]:
    ranges = (*descriptor.integer_range, *descriptor.floating_point_range)
    if not ranges:
        return {}
    limits = {'minimum': ranges[0].from_value, 'maximum': ranges[0].to_value}
    return limits | ({'step': ranges[0].step} if ranges[0].step else {})
