"""What clients of Foxglove do on the ROS graph: parameters, services, publications."""

from __future__ import annotations

from collections import defaultdict
from contextlib import suppress
from functools import partial
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any, Final

from foxglove import Schema
from foxglove.websocket import (
    ConnectionGraph,
    MessageSchema,
    Parameter,
    ServerListener,
    Service,
    ServiceSchema,
    StatusLevel,
)
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.node import NodeNameNonExistentError
from rclpy.parameter import parameter_value_to_python
from rclpy.serialization import deserialize_message, serialize_message

from composer.errors import CallTimeoutError, ComposerError
from composer.interfaces.classes import import_interface, interface_name
from composer.names import join_names
from composer.recordings.definitions import ENCODING, full_definition, import_message
from composer.runtime.messages.payload_texts import create_parameter

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from foxglove.websocket import Client, ClientChannel, ServiceRequest, WebSocketServer
    from rclpy.node import Node

_ANSWER_SEC: Final = 5.0
_POLL_SEC: Final = 0.01
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

    def refuse(self, reason: str) -> None:
        """Show clients why something is not done."""
        self._server.publish_status(reason, StatusLevel.Warning)

    def show_graph(self, topics: Iterable[str]) -> None:
        """Show clients who publishes, hears and serves what."""
        node, graph = self._node, ConnectionGraph()
        for topic in topics:
            graph.set_published_topic(topic, _nodes_of(node.get_publishers_info_by_topic(topic)))
            heard = _nodes_of(node.get_subscriptions_info_by_topic(topic))
            graph.set_subscribed_topic(topic, heard)
        servers = defaultdict[str, list[str]](list)
        for name, namespace in node.get_node_names_and_namespaces():
            # It may have gone meanwhile.
            with suppress(NodeNameNonExistentError):
                for service, _ in node.get_service_names_and_types_by_node(name, namespace):
                    servers[service].append(join_names(namespace, name))
        for service, nodes in servers.items():
            if '/_' not in service:
                graph.set_advertised_service(service, nodes)
        self._server.publish_connection_graph(graph)

    def _call_all(self, calls: Sequence[tuple[Any, str, Any]]) -> list[Any]:
        """Return the response to each request, `None` if there is none in time.

        Args:
            calls: The class of each service, its name, and the request.
        """
        known = {name for name, _ in self._node.get_service_names_and_types()}
        classes = {name: service_class for service_class, name, _ in calls if name in known}
        clients = {
            name: self._node.create_client(service_class, name)
            for name, service_class in classes.items()
        }
        deadline = monotonic() + _ANSWER_SEC
        try:
            futures = [
                clients[name].call_async(request)
                if name in clients and clients[name].wait_for_service(deadline - monotonic())
                else None
                for _, name, request in calls
            ]
            while not all(each is None or each.done() for each in futures):
                if monotonic() > deadline:
                    break
                sleep(_POLL_SEC)
            return [each.result() if each and each.done() else None for each in futures]
        finally:
            # The graph would have the services of nodes that have gone as long as the clients.
            for client in clients.values():
                self._node.destroy_client(client)

    def on_get_parameters(
        self, _client: Client, param_names: list[str], _request_id: str | None = None
    ) -> list[Parameter]:
        """Return parameters by their names, as in `/arm.speed`; all if there are none."""
        values = self._read(param_names or self._list_parameters())
        return [Parameter(name, value=_to_native(value)) for name, value in values.items()]

    def _list_parameters(self) -> list[str]:
        services = [name for name, _ in self._node.get_service_names_and_types()]
        nodes = [name.removesuffix(_LIST) for name in services if name.endswith(_LIST)]
        calls = [(ListParameters, node + _LIST, ListParameters.Request()) for node in nodes]
        answers = zip(nodes, self._call_all(calls), strict=True)
        return [f'{node}.{name}' for node, each in answers if each for name in each.result.names]

    def _read(self, names: Sequence[str]) -> dict[str, ParameterValue]:
        """Return the values of those that are set."""
        # A node that does not have one of several answers nothing.
        parts = [name.partition('.') for name in names]
        calls = [
            (GetParameters, f'{node}/get_parameters', GetParameters.Request(names=[name]))
            for node, _, name in parts
        ]
        answers = zip(names, self._call_all(calls), strict=True)
        values = {name: each.values[0] for name, each in answers if each and each.values}
        return {name: value for name, value in values.items() if value.type}

    def on_set_parameters(
        self, client: Client, parameters: Sequence[Parameter], _request_id: str | None = None
    ) -> list[Parameter]:
        """Set parameters, and return what they are then; tell clients which are refused."""
        names = [each.name for each in parameters]
        if self._allows_changes:
            self._set(parameters, self._read(names))
        else:
            self.refuse('parameters are set only with --allow-changes')
        return self.on_get_parameters(client, names)

    def _set(self, parameters: Iterable[Parameter], known: Mapping[str, ParameterValue]) -> None:
        calls = []
        for parameter in parameters:
            # Only parameters may have dots.
            node, _, name = parameter.name.partition('.')
            value: Any = parameter.get_value()
            if isinstance(value, bytes):
                value = [bytes([each]) for each in value]
            old = known.get(parameter.name, ParameterValue())
            try:
                new = create_parameter(name, value, old.type)
            except ComposerError as error:
                self.refuse(f'{parameter.name} was not set: {error}')
                continue
            request = SetParameters.Request(parameters=[new])
            calls.append((SetParameters, f'{node}/set_parameters', request))
        for (_, service, request), response in zip(calls, self._call_all(calls), strict=True):
            node = service.removesuffix('/set_parameters')
            if response is None:
                self.refuse(f'{node} does not answer')
            elif not response.results[0].successful:
                name, reason = request.parameters[0].name, response.results[0].reason
                self.refuse(f'{node}.{name} was not set: {reason}')

    def create_service(self, name: str, type_name: str) -> Service:
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


def create_schema(message_class: type) -> Schema:
    """Return what tells clients the type of messages."""
    data = full_definition(message_class).encode()
    return Schema(name=interface_name(message_class), encoding=ENCODING, data=data)


def _nodes_of(ends: Iterable[Any]) -> list[str]:
    """Return the nodes of publishers or subscriptions that are not hidden, as those of tools."""
    nodes = {join_names(each.node_namespace, each.node_name) for each in ends}
    return sorted(node for node in nodes if '/_' not in node)


def _to_native(value: ParameterValue) -> Any:
    """Return a value as the SDK takes it: bytes are one value there."""
    native = parameter_value_to_python(value)
    return b''.join(native) if value.type == ParameterType.PARAMETER_BYTE_ARRAY else native
