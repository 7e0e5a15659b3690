"""Nodes on the ROS graph as declarations: their ends with types and QoS, and their parameters."""

from __future__ import annotations

import re
import time
from collections import Counter
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rclpy.node import NodeNameNonExistentError
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

from composer.entity_kinds import KIND_OF_SECTION
from composer.errors import ComposerError
from composer.language.qos import BUILTIN_PROFILES, DEFAULT_PROFILE
from composer.names import join_names
from composer.records import record
from composer.ros_parameters.parameter_types import infer_parameter_type
from composer.runtime.messages.qos_profiles import write_policies
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

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
# Nobody declares the topics and services that each node has; they are of these packages.
_OF_EVERY_NODE = ('rcl_interfaces/', 'type_description_interfaces/')
_PARAMETERS_OF_EVERY_NODE = ('use_sim_time', 'start_type_description_service')
_QOS_OVERRIDES = 'qos_overrides.'
# Programs name these in full.
_ABSOLUTE = ('/clock', '/diagnostics', '/diagnostics_agg', '/tf', '/tf_static')
# Of an action, as in `/move/_action/send_goal` of the type `pkg/action/Move_SendGoal`.
_GOALS, _GOAL_TYPE = '/_action/send_goal', '_SendGoal'
_NOT_SET = Parameter.Type.NOT_SET
_TYPES = {kind.value: kind.name.lower() for kind in Parameter.Type if kind != _NOT_SET}
# `ros2 launch` has a node of its own; those of other tools begin with an underscore.
_OF_TOOLS = re.compile(r'_|launch_ros_\d+$')
# Longer texts, as descriptions of robots are, say nothing about the node.
_LONGEST_TEXT = 200


@record
class CapturedNode:
    """A node on the graph.

    Attributes:
        data: Its ends and parameters, as a declared node has them in the language.
        is_silent: Whether it was asked for its parameters, and did not answer.
        problem: Why something of it is missing; empty if nothing is.
    """

    name: str
    namespace: str
    data: Mapping[str, Any]
    is_silent: bool
    problem: str

    @property
    def full_name(self) -> str:
        """Its name in its namespace."""
        return join_names(self.namespace, self.name)


def capture_nodes(
    node: RosNode, executor: Executor, wanted: Sequence[str], timeout_sec: float
) -> list[CapturedNode]:
    """Return nodes with what they have.

    Args:
        node: A node that can ask the graph; it is left out.
        executor: The one that the node is in.
        wanted: Full names, or names in any namespace; all nodes if there are none.
        timeout_sec: How long nodes may take to answer.

    Raises:
        ComposerError: A node is not there, or none is.
    """
    graph = _find_graph(node, wanted)
    names = graph.choose(wanted, f'this ROS graph (ROS_DOMAIN_ID {node.context.get_domain_id()})')
    asked = [name for name in names if f'{name}/list_parameters' in graph.servers.get(name, {})]
    answers: dict[str, dict[str, Any]] = {}
    for start in range(0, len(asked), _ASKED_AT_ONCE):
        batch = asked[start : start + _ASKED_AT_ONCE]
        answers |= _read_parameters(node, executor, batch, timeout_sec)
    captured: list[CapturedNode] = []
    for full in names:
        is_silent = full in asked and full not in answers
        problem = ''
        if full in graph.repeated:
            problem = 'several nodes have this name: what they have is mixed up'
        elif full not in asked:
            problem = 'it has no parameter services: its parameters are not known'
        elif is_silent:
            problem = f'it did not answer within {timeout_sec:g} s: its parameters are not known'
        data = graph.declare_ends(full) | answers.get(full, {})
        captured.append(CapturedNode(*graph.names[full], data, is_silent, problem))
    return captured


def _find_graph(node: RosNode, wanted: Sequence[str]) -> _Graph:
    """Return the graph as soon as it has all that is wanted, and nothing new comes."""
    begun = settled = time.monotonic()
    graph = _Graph(node)
    while True:
        time.sleep(_POLL_SEC)
        latest, now = _Graph(node), time.monotonic()
        if latest.shape != graph.shape:
            graph, settled = latest, now
        has_wanted = all(graph.matching(name) for name in wanted)
        is_complete = graph.names and has_wanted and not graph.has_unknown
        patience = _SETTLED_SEC if is_complete else _PATIENCE_SEC
        if now - settled > patience or now - begun > _LONGEST_SEARCH_SEC:
            return latest


class _Graph:
    """The graph at a time.

    Attributes:
        names: The full names of the nodes with their names and namespaces.
        repeated: Those that several nodes have.
        servers: By full names of nodes, the services that they serve, with their types.
        has_unknown: Whether the node of an end is not known yet.
        shape: What tells apart two graphs.
    """

    def __init__(self, node: RosNode) -> None:
        present = sorted(node.get_node_names_and_namespaces())
        self.names = {join_names(space, name): (name, space) for name, space in present}
        often = Counter(join_names(space, name) for name, space in present)
        self.repeated = {full for full, count in often.items() if count > 1}
        self.names.pop(join_names(node.get_namespace(), node.get_name()), None)
        # By the full names of nodes, the sections, and the short names of topics and services. A
        # node that has ended may still have ends.
        self._ends: dict[str, dict[str, dict[str, list[Any]]]] = {}
        self._add_topics(node)
        self._add_services(node)
        self.has_unknown = not self._ends.keys() <= self.names.keys()
        self.shape = repr((self.names, self._ends, self.servers))

    def _add_topics(self, node: RosNode) -> None:
        for topic, types in sorted(node.get_topic_names_and_types()):
            if '/_' in topic or types[0].startswith(_OF_EVERY_NODE):
                continue
            publishers = node.get_publishers_info_by_topic(topic)
            subscriptions = node.get_subscriptions_info_by_topic(topic)
            for section, infos in (('publishers', publishers), ('subscriptions', subscriptions)):
                for info in infos:
                    owner = join_names(info.node_namespace, info.node_name)
                    qos = _differing(info.qos_profile)
                    entry = {'type': info.topic_type} | ({'qos': qos} if qos else {})
                    self._add(owner, section, topic, entry, is_alone=not publishers)

    def _add_services(self, node: RosNode) -> None:
        self.servers: dict[str, dict[str, str]] = {}
        clients: dict[str, dict[str, str]] = {}
        for full, names in self.names.items():
            # It may have ended since.
            with suppress(NodeNameNonExistentError):
                served = sorted(node.get_service_names_and_types_by_node(*names))
                called = sorted(node.get_client_names_and_types_by_node(*names))
                self.servers[full] = {name: types[0] for name, types in served if types}
                clients[full] = {name: types[0] for name, types in called if types}
        all_served = {name for services in self.servers.values() for name in services}
        for suffix, sides in (('s', self.servers), ('_clients', clients)):
            for owner, services in sides.items():
                for name, kind in services.items():
                    is_common = kind.startswith(_OF_EVERY_NODE)
                    is_own = suffix == 's' and is_common and name.startswith(f'{owner}/')
                    is_alone = name not in all_served or is_common
                    if name.endswith(_GOALS) and kind.endswith(_GOAL_TYPE):
                        action = name.removesuffix(_GOALS)
                        entry = {'type': kind.removesuffix(_GOAL_TYPE)}
                        self._add(owner, f'action{suffix}', action, entry, is_alone=is_alone)
                    elif '/_' not in name and not is_own:
                        section = f'service{suffix}'
                        self._add(owner, section, name, {'type': kind}, is_alone=is_alone)

    def _add(
        self, owner: str, section: str, name: str, entry: dict[str, Any], *, is_alone: bool
    ) -> None:
        """Add an end of a topic, service or action of that full name."""
        if name.startswith(f'{owner}/'):
            name = f'~{name.removeprefix(owner)}'
        elif name not in _ABSOLUTE:
            name = name.removeprefix(f'{owner.rpartition("/")[0]}/')
        if is_alone and not KIND_OF_SECTION[section].provides:
            entry = entry | {'external': True}
        sections = self._ends.setdefault(owner, {each: {} for each in KIND_OF_SECTION})
        twins = sections[section].setdefault(name, [])
        if entry not in twins:
            twins.append(entry)

    def choose(self, wanted: Sequence[str], where: str) -> list[str]:
        """Return the full names of the nodes that are wanted; those of tools only if named."""
        shown = [
            full
            for full, (name, space) in self.names.items()
            # A system has a hidden node, and beside it one that answers as a container does.
            if not _OF_TOOLS.match(name) and join_names(space, f'_{name}') not in self.names
        ]
        if not wanted and not shown:
            message = f'there are no nodes on {where}'
            raise ComposerError(message, help='start what is to be captured first')
        for name in wanted:
            if not self.matching(name):
                options = shown if '/' in name else [full.rpartition('/')[2] for full in shown]
                help_text = suggest(name, options, 'there are', 'there are none')
                message = f"there is no node '{name}' on {where}"
                raise ComposerError(message, help=help_text)
        chosen = dict.fromkeys(full for name in wanted for full in self.matching(name))
        return list(chosen) if wanted else shown

    def matching(self, name: str) -> list[str]:
        """Return the full names of the nodes that a name is for."""
        return [full for full in self.names if name == full or full.endswith(f'/{name}')]

    def declare_ends(self, owner: str) -> dict[str, Any]:
        """Return the ends of a node, as a declared node has them in the language."""
        data: dict[str, Any] = {}
        for section, ends in self._ends.get(owner, {}).items():
            channel = str(KIND_OF_SECTION[section].channel)
            entries: dict[str, Any] = {}
            for name, twins in ends.items():
                entries[name] = twins[0] if len(twins[0]) > 1 else twins[0]['type']
                for index, entry in enumerate(twins[1:], 2):
                    entries[f'{name}_{index}'] = entry | {channel: name}
            data |= {section: entries} if entries else {}
        return data


def _differing(profile: QoSProfile) -> dict[str, Any]:
    """Return the policies of an end that differ from the defaults; what is not known does not."""
    defaults = BUILTIN_PROFILES[DEFAULT_PROFILE] | {'liveliness': 'automatic'}
    policies = write_policies(profile)
    if policies['history'] != 'keep_last':
        policies.pop('depth', None)
    return {
        policy: value
        for policy, value in policies.items()
        if value not in ('unknown', 'system_default', defaults.get(policy))
    }


def _read_parameters(
    node: RosNode, executor: Executor, names: Collection[str], timeout_sec: float
) -> dict[str, dict[str, Any]]:
    """Return `parameters` of declared nodes by their full names, of those that answer in time.

    It is missing if something about a parameter is not known.
    """

    def wait(calls: Mapping[str, Any]) -> dict[str, Any]:
        deadline = time.monotonic() + timeout_sec
        for call in calls.values():
            left_sec = max(0.0, deadline - time.monotonic())
            executor.spin_until_future_complete(call, left_sec)
        return {name: call.result() for name, call in calls.items() if call.done()}

    clients = {name: AsyncParameterClient(node, name) for name in names}
    begun = time.monotonic()
    listing = {
        name: client.list_parameters()
        for name, client in clients.items()
        if client.wait_for_services(max(0.0, begun + timeout_sec - time.monotonic()))
    }
    listed = {
        name: sorted(
            parameter
            for parameter in answer.result.names
            if parameter not in _PARAMETERS_OF_EVERY_NODE
            and not parameter.startswith(_QOS_OVERRIDES)
        )
        for name, answer in wait(listing).items()
    }
    described = wait(
        {name: clients[name].describe_parameters(own) for name, own in listed.items()}
    )
    values = wait({name: clients[name].get_parameters(own) for name, own in listed.items()})
    answers: dict[str, dict[str, Any]] = {}
    for name in described.keys() & values.keys():
        answer = (described[name].descriptors, values[name].values)
        declared = [*map(_declare_parameter, *answer)]
        is_known = len(declared) == len(listed[name]) and None not in declared
        parameters = dict(zip(listed[name], declared, strict=False))
        answers[name] = {'parameters': parameters} if is_known else {}
    return answers


def _declare_parameter(descriptor: Any, value: Any) -> Any:
    """Return a parameter as its value, if that tells its type, or as a declaration.

    `None` is one whose type is not known.
    """
    type_name = _TYPES.get(descriptor.type) or _TYPES.get(value.type)
    if type_name is None:
        return None
    declared: dict[str, Any] = {'type': type_name}
    is_set = value.type in _TYPES and type_name != 'byte_array'
    plain = parameter_value_to_python(value) if is_set else None
    if plain is not None and not (isinstance(plain, str) and len(plain) > _LONGEST_TEXT):
        declared['default'] = plain if isinstance(plain, bool | int | float | str) else [*plain]
    declared |= {'description': descriptor.description} if descriptor.description else {}
    declared |= {'read_only': True} if descriptor.read_only else {}
    for limits in (*descriptor.integer_range, *descriptor.floating_point_range):
        declared |= {'minimum': limits.from_value, 'maximum': limits.to_value}
        declared |= {'step': limits.step} if limits.step else {}
    is_plain = declared.keys() == {'type', 'default'} and infer_parameter_type(plain) == type_name
    return declared['default'] if is_plain else declared
