"""Shows Foxglove what is on the ROS graph, and does there what its clients ask.

A client gets the messages that it subscribes to. They are taken as a recording takes them: see
`SystemRecorder`.
"""

from __future__ import annotations

import json
import os
import socket
import threading
from collections import Counter, defaultdict, deque
from contextlib import suppress
from functools import partial
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any, Final

import foxglove
from foxglove import Schema
from foxglove.websocket import (
    Capability,
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
from rclpy.exceptions import InvalidHandle
from rclpy.node import NodeNameNonExistentError
from rclpy.parameter import parameter_value_to_python
from rclpy.serialization import deserialize_message, serialize_message
from websockets import Subprotocol
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from composer.errors import CallTimeoutError, ComposerError, StartError
from composer.interfaces.classes import import_interface, interface_name
from composer.names import join_names
from composer.recordings.definitions import ENCODING, full_definition, import_message
from composer.recordings.system_recorder import SystemRecorder
from composer.records import record
from composer.runtime.messages.payload_texts import create_parameter
from composer.runtime.middleware.ros_graph import create_graph_node
from composer.runtime.system_executor import SystemExecutor

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from foxglove.websocket import ChannelView, Client, ClientChannel, ServiceRequest
    from rclpy.context import Context

    from composer.foxglove import BridgeOptions
    from composer.recordings.recorder import Log
    from composer.runtime.messages.local_delivery import LocalTopics

_LOOK_SEC: Final = 1.0
_STOP_SEC: Final = 2.0
_BURST_SEC: Final = 0.03
_IDLE_SEC: Final = 0.2
_ROOM: Final = 10_000
# For a client that reads too slowly; older messages are dropped then.
_BACKLOG: Final = 256
# A client that takes nothing for so long is disconnected.
_STALL_MS: Final = 5000
_ANSWER_SEC: Final = 5.0
_POLL_SEC: Final = 0.01
_LISTENER: Final = '_composer_foxglove_listener'
_PROTOCOL: Final = 'foxglove.sdk.v1'
_LIST: Final = '/list_parameters'


@record
class _Channel:
    """A topic of one type, as clients see it."""

    topic: str
    base: foxglove.Channel


class FoxgloveBridge(ServerListener):
    """Serves clients from `start` to `stop`; it is the recorder of what they subscribe to.

    Args:
        name: What clients show.
        log: Gets the address, and what keeps a topic from being shown.

    Attributes:
        queue: Takes messages, and they are sent soon.
        room: How many messages may wait to be sent.
        lost: How many did not, as there was no room.

    Raises:
        StartError: The port is taken.
    """

    room, lost = _ROOM, 0

    def __init__(self, options: BridgeOptions, name: str, log: Log) -> None:
        self._allows_changes = options.allows_changes
        self._publishers: dict[tuple[int, int], Any] = {}
        self.queue: deque[Any] = deque()
        self._log = log
        self._address = options.address
        self._sink = foxglove.Context()
        self._channels: dict[tuple[str, str], _Channel] = {}
        self._services: set[str] = set()
        self._wanted: Counter[str] = Counter()
        self._warned: set[str] = set()
        self._may_show_graph = threading.Event()
        # The topics that the threads of the server tell of; they may hold its locks.
        self._changed: deque[str] = deque()
        self._ended = threading.Event()
        changing = [Capability.ClientPublish, Capability.Services]
        reading = [Capability.ConnectionGraph, Capability.Parameters]
        try:
            self._server = foxglove.start_server(
                name=name,
                host=options.address,
                port=options.port,
                capabilities=[*reading, *(changing if options.allows_changes else ())],
                supported_encodings=['cdr'],
                server_listener=self,
                context=self._sink,
                message_backlog_size=_BACKLOG,
            )
        except (OSError, RuntimeError, ValueError) as error:
            message = f'Foxglove cannot be served at {options.address}:{options.port}: {error}'
            raise StartError(message, help='--foxglove 0 takes any port that is free') from error
        _limit_stalls(self._server.port)
        log.info(f'Foxglove: open ws://{options.address}:{self._server.port}')
        self._recorder = SystemRecorder(self, self, self._warn_once, _LISTENER, is_late=True)
        self._thread = threading.Thread(target=self._run, name='composer-foxglove', daemon=True)

    def start(self, context: Context, topics: LocalTopics | None = None) -> None:
        """Begin.

        Args:
            topics: Those of the system that runs in this process.
        """
        self._executor = SystemExecutor(context, None, log=self._log.error)
        self._node = create_graph_node(context, '_composer_foxglove')
        self._executor.add_node(self._node)
        self._executor.start()
        self._recorder.start(context, topics)
        self._thread.start()

    def stop(self) -> None:
        """End; do nothing the second time, or if it never began."""
        if self._ended.is_set():
            return
        self._ended.set()
        if self._thread.ident is not None:
            self._thread.join(_STOP_SEC)
            self._recorder.stop()
            self._executor.stop(_STOP_SEC)
            self._node.destroy_node()
        self._server.stop()

    def _run(self) -> None:
        """Send what comes in bursts: to wake a thread for each message costs far more."""
        next_look = 0.0
        while not self._ended.wait(_BURST_SEC if self._wanted.total() else _IDLE_SEC):
            self._try(self._send)
            while self._changed:
                self._try(self._recorder.follow, self._changed.popleft())
            if monotonic() >= next_look:
                self._try(self._look)
                next_look = monotonic() + _LOOK_SEC

    def _try(self, act: Callable[..., object], *arguments: Any) -> None:
        try:
            act(*arguments)
        except InvalidHandle:
            # A behaviour may have shut down what all use; the system ends then.
            pass
        except Exception as error:  # noqa: BLE001 - the bridge goes on with all others
            self._warn_once(f'not all is shown to Foxglove: {error}')

    def _warn_once(self, text: str) -> None:
        # Each message of a topic may have an error of its own.
        subject = text.partition(': ')[0]
        if subject not in self._warned:
            self._warned.add(subject)
            self._log.warning(text)

    # As a recorder, and as its patterns

    def _send(self) -> None:
        for _ in range(len(self.queue)):
            channel, _, published_ns, data = self.queue.popleft()
            # The clock of a publisher may be before 1970.
            channel.base.log(data, log_time=max(0, published_ns))

    def has(self, topic: str) -> bool:
        """Return whether a client subscribes to a topic."""
        return self._wanted[topic] > 0

    def open_channel(
        self, topic: str, message_class: type, _offers: Iterable[Mapping[str, Any]] = ()
    ) -> Any:
        """Return the channel of a topic and type, of which there is one."""
        key = topic, interface_name(message_class)
        if key not in self._channels:
            schema = create_schema(message_class)
            base = foxglove.Channel(
                topic, message_encoding='cdr', schema=schema, context=self._sink
            )
            self._channels[key] = _Channel(topic, base)
        return self._channels[key]

    def finish(self, _remarks: Iterable[str] = ()) -> None:
        """Do nothing: what was sent is sent."""

    def describe_unused(self, _topics: Iterable[str]) -> list[str]:
        """Return nothing: what clients subscribe to is there."""
        return []

    # The graph

    def _look(self) -> None:
        """Show topics and services that have come, and no more those that have gone."""
        topics = {
            (topic, each)
            for topic, types in self._node.get_topic_names_and_types()
            if '/_' not in topic
            for each in types
        }
        for topic, type_name in topics - self._channels.keys():
            with suppress(ComposerError):
                self.open_channel(topic, import_message(type_name))
        for key in self._channels.keys() - topics:
            self._channels.pop(key).base.close()
        if self._allows_changes:
            self._show_services()
        if self._may_show_graph.is_set():
            self._show_graph({topic for topic, _ in topics})

    def _show_services(self) -> None:
        services = {
            name: types[0]
            for name, types in self._node.get_service_names_and_types()
            if '/_' not in name
        }
        for name in services.keys() - self._services:
            with suppress(ComposerError):
                self._server.add_services([self._create_service(name, services[name])])
        if gone := self._services - services.keys():
            self._server.remove_services(list(gone))
        self._services = set(services)

    # What clients ask: `foxglove.websocket.ServerListener`

    def on_subscribe(self, _client: Client, channel: ChannelView) -> None:
        """Have the topic listened to; anew, if it is, as a latched message is then sent again."""
        self._wanted[channel.topic] += 1
        self._changed.append(channel.topic)

    def on_unsubscribe(self, _client: Client, channel: ChannelView) -> None:
        """Listen no more, if this was the last one."""
        self._wanted[channel.topic] -= 1
        if not self._wanted[channel.topic]:
            self._changed.append(channel.topic)

    def on_connection_graph_subscribe(self) -> None:
        """Show the graph, soon and when it changes."""
        threading.Thread(target=self._watch_graph, name='composer-graph', daemon=True).start()

    def _watch_graph(self) -> None:
        """Subscribe to the graph as a client until the end.

        The server tells of the first subscription and of the end of the last one with a lock held,
        for which the publication of the graph waits with the interpreter held: for ever, if both
        happen at a time. While this subscription is there, no other one is the first or the last.
        """
        with (
            suppress(OSError, WebSocketException),
            connect(
                'ws://localhost',
                sock=socket.create_connection((self._address, self._server.port)),
                subprotocols=[Subprotocol(_PROTOCOL)],
                max_size=None,
            ) as connection,
        ):
            connection.send(json.dumps({'op': 'subscribeConnectionGraph'}))
            for message in connection:
                if isinstance(message, str) and '"connectionGraphUpdate"' in message:
                    self._may_show_graph.set()
        self._may_show_graph.clear()

    def _refuse(self, reason: str) -> None:
        """Show clients why something is not done."""
        self._server.publish_status(reason, StatusLevel.Warning)

    def _show_graph(self, topics: Iterable[str]) -> None:
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
            self._refuse('parameters are set only with --allow-changes')
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
                self._refuse(f'{parameter.name} was not set: {error}')
                continue
            request = SetParameters.Request(parameters=[new])
            calls.append((SetParameters, f'{node}/set_parameters', request))
        for (_, service, request), response in zip(calls, self._call_all(calls), strict=True):
            node = service.removesuffix('/set_parameters')
            if response is None:
                self._refuse(f'{node} does not answer')
            elif not response.results[0].successful:
                name, reason = request.parameters[0].name, response.results[0].reason
                self._refuse(f'{node}.{name} was not set: {reason}')

    def _create_service(self, name: str, type_name: str) -> Service:
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
            self._refuse(f"'{channel.topic}' cannot be published: {error}")
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


def _limit_stalls(port: int) -> None:
    """Have the kernel end connections to clients that take nothing: the SDK would keep them.

    Connections inherit the limit from the socket that listens.

    Source: TCP_USER_TIMEOUT in https://man7.org/linux/man-pages/man7/tcp.7.html
    """
    for path in Path('/proc/self/fd').iterdir():
        with suppress(OSError):
            if not path.is_socket():
                continue
            with socket.socket(fileno=os.dup(int(path.name))) as found:
                is_tcp = found.family in (socket.AF_INET, socket.AF_INET6)
                listens = found.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)
                if is_tcp and listens and found.getsockname()[1] == port:
                    found.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _STALL_MS)
