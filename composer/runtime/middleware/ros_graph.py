"""The ROS graph as it is now, without the nodes that have not started."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING

from rclpy.node import Node as RosNode
from rclpy.node import NodeNameNonExistentError
from rclpy.parameter import Parameter

from composer.names import join_names, split_name
from composer.runtime.logs import system_logger
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from rclpy.context import Context

    from composer.language.specs import ConditionKind
    from composer.runtime.nodes.live_node import LiveNode

_NODE_NAME = '_composer_waiting'
# One a second; other nodes are found some time after the start.
_MOST_LOOKS = 10
# An action exists if the service for its goals does
# (https://design.ros2.org/articles/actions.html).
_GOALS = '/_action/send_goal'
# Nearly every node has them, and hardly anybody waits for them.
_COMMON_TOPICS = ('/rosout', '/parameter_events', '/diagnostics')
_COMMON_SERVICES = (
    '/describe_parameters',
    '/get_parameter_types',
    '/get_parameters',
    '/get_type_description',
    '/list_parameters',
    '/set_parameters',
    '/set_parameters_atomically',
)
_TYPES_OF_EVERY_NODE = {
    'rcl_interfaces/msg/Log',
    'rcl_interfaces/msg/ParameterEvent',
    'type_description_interfaces/srv/GetTypeDescription',
    *(f'rcl_interfaces/srv/{name}' for name in ('DescribeParameters', 'GetParameterTypes')),
    *(f'rcl_interfaces/srv/{name}' for name in ('GetParameters', 'ListParameters')),
    *(f'rcl_interfaces/srv/{name}' for name in ('SetParameters', 'SetParametersAtomically')),
    *(f'rcl_interfaces/srv/{name}' for name in ('GetLoggerLevels', 'SetLoggerLevels')),
}
_INTRODUCTIONS = {
    'topic': 'published topics',
    'service': 'services',
    'action': 'actions',
    'node': 'nodes',
}


class RosGraph:
    """The ROS graph without the nodes of the system that have not started, and their entities.

    Attributes:
        hidden: The full names of these nodes.
    """

    def __init__(self, node: RosNode, hidden: frozenset[str]) -> None:
        self._node = node
        self.hidden = hidden

    def has(self, kind: ConditionKind, name: str) -> bool:
        """Return whether there is a topic, service, action or node of this full name."""
        if kind == 'topic':
            return self._is_published(name)
        if kind == 'node':
            return name in self._nodes
        service = name + _GOALS if kind == 'action' else name
        # This list is fast, but includes services that only have clients.
        listed = any(name == service for name, _ in self._node.get_service_names_and_types())
        return listed and service in self._served

    def names(self, kind: ConditionKind) -> Collection[str]:
        """Return all full names of a kind."""
        found: Collection[str] = getattr(self, f'_{kind}s')
        return found

    def names_of(self, node: LiveNode, kind: ConditionKind) -> Collection[str]:
        """Return the full names of what a node provides, whether it has started or not."""
        if kind == 'node':
            return [node.full_name]
        where = node.ros.get_name(), node.ros.get_namespace()
        if kind == 'topic':
            return [name for name, _ in self._node.get_publisher_names_and_types_by_node(*where)]
        return _select(kind, self._services_of(*where))

    @cached_property
    def _nodes(self) -> set[str]:
        found = {join_names(namespace, name) for name, namespace in self._present}
        return found - {f'/{_NODE_NAME}'}

    @cached_property
    def _topics(self) -> set[str]:
        return {
            topic
            for topic, _ in self._node.get_topic_names_and_types()
            if self._is_published(topic)
        }

    @cached_property
    def _services(self) -> set[str]:
        return set(_select('service', self._served))

    @cached_property
    def _actions(self) -> set[str]:
        return set(_select('action', self._served))

    @cached_property
    def _present(self) -> list[tuple[str, str]]:
        return [
            (name, namespace)
            for name, namespace in self._node.get_node_names_and_namespaces()
            if join_names(namespace, name) not in self.hidden
        ]

    @cached_property
    def _served(self) -> set[str]:
        found: set[str] = set()
        for name, namespace in self._present:
            found.update(self._services_of(name, namespace))
        return found

    def _is_published(self, topic: str) -> bool:
        return any(
            join_names(each.node_namespace, each.node_name) not in self.hidden
            for each in self._node.get_publishers_info_by_topic(topic)
        )

    def _services_of(self, name: str, namespace: str) -> list[str]:
        # A node may end between two queries.
        with suppress(NodeNameNonExistentError):
            services = self._node.get_service_names_and_types_by_node(name, namespace)
            return [service for service, _ in services]
        return []


def find_ends(ros: RosNode, full_name: str) -> list[tuple[str, str]]:
    """Return the noun and full name of each end of a node, but of those that all nodes have."""
    namespace, name = split_name(full_name)
    ends: list[tuple[str, str]] = []
    with suppress(NodeNameNonExistentError):
        for noun, listed in (
            ('publisher', ros.get_publisher_names_and_types_by_node(name, namespace)),
            ('subscription', ros.get_subscriber_names_and_types_by_node(name, namespace)),
            ('service', ros.get_service_names_and_types_by_node(name, namespace)),
        ):
            ends += [(noun, end) for end, types in listed if not _TYPES_OF_EVERY_NODE & {*types}]
    return ends


class SameNames:
    """Warns once, after the start, of a node elsewhere with the name of one of this process.

    Args:
        find_nodes: Returns the nodes of this process.
    """

    def __init__(self, find_nodes: Callable[[], Iterable[RosNode]]) -> None:
        self._find_nodes = find_nodes
        # Nodes that an edit brings may be in the graph twice for a moment.
        self._own: list[tuple[str, str]] = []
        self._looks_left = _MOST_LOOKS

    def check(self, node: RosNode) -> None:
        """Look at the graph through a node."""
        if self._looks_left == _MOST_LOOKS:
            self._own = [(each.get_name(), each.get_namespace()) for each in self._find_nodes()]
        if not self._looks_left:
            return
        self._looks_left -= 1
        present = Counter(node.get_node_names_and_namespaces())
        twice = [
            join_names(namespace, name)
            for name, namespace in self._own
            if present[name, namespace] > 1
        ]
        if twice:
            self._looks_left = 0
            more = f' (and {len(twice) - 1} more)' if twice[1:] else ''
            system_logger.warning(
                f"a node '{twice[0]}'{more} runs already on this ROS graph: services, actions and "
                'parameters are there twice; give one a namespace, or another ROS_DOMAIN_ID'
            )


def create_graph_node(context: Context, name: str = _NODE_NAME) -> RosNode:
    """Return a node that can query the graph; those of the system may be restarted at any time."""
    return RosNode(
        name,
        context=context,
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=[Parameter('start_type_description_service', value=False)],
    )


def _select(kind: ConditionKind, services: Iterable[str]) -> list[str]:
    if kind == 'action':
        return [name.removesuffix(_GOALS) for name in services if name.endswith(_GOALS)]
    return [name for name in services if '/_' not in name]


def describe_graph(kind: ConditionKind, name: str, graph: RosGraph) -> str:
    """Return the nearest names in the graph as a help text."""
    names = [
        each
        for each in graph.names(kind)
        if not (each in _COMMON_TOPICS or '/_' in each or each.endswith(_COMMON_SERVICES))
    ]
    common = ' except those of every node' if kind in ('topic', 'service') else ''
    return suggest(name, names, _INTRODUCTIONS[kind]) or f'there are no {kind}s{common}'
