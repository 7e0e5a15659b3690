"""What clients of Foxglove do on the ROS graph: parameters, services, publications."""

from __future__ import annotations

import threading
from collections import defaultdict
from contextlib import suppress
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

from foxglove.websocket import (
    ConnectionGraph,
    MessageSchema,
    Parameter,
    ServerListener,
    Service,
    ServiceSchema,
    StatusLevel,
)
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.exceptions import InvalidServiceNameException
from rclpy.node import NodeNameNonExistentError
from rclpy.parameter import Parameter as RosParameter
from rclpy.parameter import parameter_value_to_python
from rclpy.serialization import deserialize_message, serialize_message

from composer.errors import CallTimeoutError
from composer.interfaces.classes import import_interface
from composer.names import join_names
from composer.recordings.definitions import import_message
from composer.runtime.messages.payload_texts import fit_value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from foxglove.websocket import Client, ClientChannel, ServiceRequest, WebSocketServer
    from rclpy.node import Node

_ANSWER_SEC: Final = 5.0
_LIST: Final = '/list_parameters'


class GraphAccess(ServerListener):
    """What clients ask and do; `_node` acts for them on the graph, and an executor spins it.

    Args:
        allows_changes: Whether clients may publish, call services and set parameters.
    """

    _node: Node
    _server: WebSocketServer

    def __init__(self, *, allows_changes: bool) -> None:
        self._allows_changes = allows_changes
        self._publishers: dict[tuple[int, int], Any] = {}
        self._graph: Any = None

    def refuse(self, reason: str) -> None:
        """Show clients why something is not done."""
        self._server.publish_status(reason, StatusLevel.Warning)

    def show_graph(self, topics: Iterable[str]) -> None:
        """Show clients who publishes, hears and serves what, if that is new."""
        node, servers = self._node, defaultdict[str, list[str]](list)
        for name, namespace in node.get_node_names_and_namespaces():
            # It may have gone meanwhile.
            with suppress(NodeNameNonExistentError):
                for service, _ in node.get_service_names_and_types_by_node(name, namespace):
                    if '/_' not in service:
                        servers[service].append(join_names(namespace, name))
        published = {each: _nodes_of(node.get_publishers_info_by_topic(each)) for each in topics}
        heard = {each: _nodes_of(node.get_subscriptions_info_by_topic(each)) for each in topics}
        if self._graph == (published, heard, servers):
            return
        self._graph, graph = (published, heard, servers), ConnectionGraph()
        for topic, nodes in published.items():
            graph.set_published_topic(topic, nodes)
        for topic, nodes in heard.items():
            graph.set_subscribed_topic(topic, nodes)
        for service, nodes in servers.items():
            graph.set_advertised_service(service, nodes)
        self._server.publish_connection_graph(graph)

    def _call_all(self, calls: Sequence[tuple[Any, str, Any]]) -> list[Any]:
        """Return the response to each request, `None` if there is none in time.

        Args:
            calls: The class of each service, its name, and the request.
        """
        clients: dict[str, Any] = {}
        futures: list[Any] = []
        responses = []
        deadline = monotonic() + _ANSWER_SEC
        try:
            for service_class, name, _ in calls:
                # There is no service of a wrong name.
                with suppress(InvalidServiceNameException):
                    if name not in clients:
                        clients[name] = self._node.create_client(service_class, name)
            for _, name, request in calls:
                client, left_sec = clients.get(name), max(0.0, deadline - monotonic())
                if client is not None and client.wait_for_service(left_sec):
                    futures.append(client.call_async(request))
                else:
                    futures.append(None)
            for future in futures:
                done = threading.Event()
                if future is not None:
                    future.add_done_callback(lambda _, done=done: done.set())
                    done.wait(max(0.0, deadline - monotonic()))
                is_done = future is not None and future.done()
                responses.append(future.result() if is_done else None)
        finally:
            # The graph would have the services of nodes that have gone as long as the clients.
            for client in clients.values():
                self._node.destroy_client(client)
        return responses

    def on_get_parameters(
        self, _client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """Return parameters by their names, as in `/arm.speed`; all if there are none."""
        del request_id
        return self._read_parameters(param_names or self._list_parameters())

    def _read_parameters(self, names: Iterable[str]) -> list[Parameter]:
        values = self._read(names)
        return [each for name, value in values.items() for each in _show(name, value)]

    def _list_parameters(self) -> list[str]:
        services = [name for name, _ in self._node.get_service_names_and_types()]
        nodes = [name.removesuffix(_LIST) for name in services if name.endswith(_LIST)]
        calls = [(ListParameters, node + _LIST, ListParameters.Request()) for node in nodes]
        answers = zip(nodes, self._call_all(calls), strict=True)
        return [f'{node}.{name}' for node, each in answers if each for name in each.result.names]

    def _read(self, names: Iterable[str]) -> dict[str, Any]:
        # A node that does not have one of several answers nothing.
        parts = [name.partition('.') for name in names]
        calls = [
            (GetParameters, f'{node}/get_parameters', GetParameters.Request(names=[name]))
            for node, _, name in parts
        ]
        answers = zip(parts, self._call_all(calls), strict=True)
        return {
            f'{node}.{name}': response.values[0]
            for (node, _, name), response in answers
            if response is not None and response.values
        }

    def on_set_parameters(
        self, _client: Client, parameters: Sequence[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """Set parameters, and return what they are then; tell clients which are refused."""
        del request_id
        names = [each.name for each in parameters]
        if not self._allows_changes:
            self.refuse('parameters are set only with --allow-changes')
            return self._read_parameters(names)
        types = {name: value.type for name, value in self._read(names).items()}
        calls = []
        for parameter in parameters:
            # Only parameters may have dots.
            node, _, name = parameter.name.partition('.')
            try:
                value: Any = parameter.get_value()
                if isinstance(value, bytes):
                    value = [bytes([each]) for each in value]
                value = fit_value(
                    value, types.get(parameter.name, ParameterType.PARAMETER_NOT_SET)
                )
                ros = RosParameter(name, value=value).to_parameter_msg()
            except (AttributeError, TypeError, ValueError):
                self.refuse(f'{parameter.name} was not set: it has no type of ROS')
                continue
            request = SetParameters.Request(parameters=[ros])
            calls.append((SetParameters, f'{node}/set_parameters', request))
        for (_, service, request), response in zip(calls, self._call_all(calls), strict=True):
            node = service.removesuffix('/set_parameters')
            if response is None:
                self.refuse(f'{node} does not answer')
            elif not response.results[0].successful:
                name, reason = request.parameters[0].name, response.results[0].reason
                self.refuse(f'{node}.{name} was not set: {reason}')
        return self._read_parameters(names)

    def create_service(
        self, name: str, type_name: str, create_schema: Callable[[type], Any]
    ) -> Service:
        """Return a service of the graph as clients call it.

        Raises:
            ComposerError: Its type is not installed.
        """
        service_class: Any = import_interface(type_name)
        request, response = (
            MessageSchema(encoding='cdr', schema=create_schema(part))
            for part in (service_class.Request, service_class.Response)
        )
        schema = ServiceSchema(type_name, request=request, response=response)
        return Service(name, schema=schema, handler=partial(self._serve, service_class))

    def _serve(self, service_class: Any, asked: ServiceRequest) -> bytes:
        request = deserialize_message(asked.payload, service_class.Request)
        (response,) = self._call_all([(service_class, asked.service_name, request)])
        if response is None:
            message = f"'{asked.service_name}' did not answer within {_ANSWER_SEC:g} s"
            raise CallTimeoutError(message)
        return bytes(serialize_message(response))

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """Create a publisher for a client."""
        try:
            message_class = import_message(channel.schema_name)
            publisher = self._node.create_publisher(message_class, channel.topic, 10)
        except Exception as error:  # noqa: BLE001 - rclpy raises many kinds for wrong names
            self.refuse(f"'{channel.topic}' cannot be published: {error}")
            return
        self._publishers[client.id, channel.id] = publisher

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """Destroy the publisher of a client."""
        if (publisher := self._publishers.pop((client.id, client_channel_id), None)) is not None:
            self._node.destroy_publisher(publisher)

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """Publish a message of a client, in CDR."""
        if (publisher := self._publishers.get((client.id, client_channel_id))) is not None:
            publisher.publish(data)


def _nodes_of(ends: Iterable[Any]) -> list[str]:
    """Return the nodes of publishers or subscriptions that are not hidden, as those of tools."""
    nodes = {join_names(each.node_namespace, each.node_name) for each in ends}
    return sorted(node for node in nodes if '/_' not in node)


def _show(name: str, value: Any) -> Iterator[Parameter]:
    native = parameter_value_to_python(value)
    if value.type == ParameterType.PARAMETER_BYTE_ARRAY:
        native = b''.join(native)
    elif not isinstance(native, bool | int | float | str | None):
        native = list(native)
    if native is not None:
        yield Parameter(name, value=native)
