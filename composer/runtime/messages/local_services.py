"""Requests to services of the system are handed over, and so are the responses.

A call is sent as before if the client and the server would not meet, if somebody else of the
system serves the same name, and while the client or the server is introspected: the events of
service introspection come from the middleware.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from sys import getrefcount
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from rclpy.qos import QoSCompatibility, qos_check_compatible
from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.task import Future

from composer.runtime.messages.local_delivery import queue_depth, why_sent
from composer.runtime.messages.ownership import ownership_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.client import Client as RosClient
    from rclpy.qos import QoSProfile
    from rclpy.service import Service as RosService

    from composer.executor import ComposerExecutor
    from composer.executor.sources.inbox import Inbox

# The name in the graph, and the type.
_Key: TypeAlias = 'tuple[str, type]'


class LocalEnd:
    """A service or a client of the system.

    Args:
        node: The rclpy node that it belongs to.
        name: Its name in the graph.
        connect: Called with the key when it may be connected otherwise.

    Attributes:
        key: The name and the type.
    """

    def __init__(
        self, node: Any, ros: RosService | RosClient, name: str, connect: Callable[[_Key], None]
    ) -> None:
        self.node = node
        self.ros = ros
        self.key: _Key = (name, ros.srv_type)
        self._connect = connect
        self._is_allowed = True
        self._is_introspected = False
        self._configure: Callable[..., None] = ros.configure_introspection
        ros.configure_introspection = self._configure_introspection

    @property
    def is_local(self) -> bool:
        """Whether its requests may be handed over."""
        is_sent = self._is_introspected or bool(why_sent(self.ros.qos_profile))
        return self._is_allowed and not is_sent

    def allow(self, *, is_allowed: bool) -> None:
        """Let its requests be handed over, or have all of them sent."""
        self._is_allowed = is_allowed
        self._connect(self.key)

    def _configure_introspection(self, clock: Any, qos: QoSProfile, state: Any) -> None:
        self._configure(clock, qos, state)
        self._is_introspected = state != ServiceIntrospectionState.OFF
        self._connect(self.key)


class LocalService(LocalEnd):
    """A service of the system.

    Args:
        inbox: Takes requests.
    """

    def __init__(
        self,
        node: Any,
        ros: RosService,
        name: str,
        connect: Callable[[_Key], None],
        inbox: Inbox,
    ) -> None:
        super().__init__(node, ros, name, connect)
        self._inbox = inbox
        self._requests = ownership_of(ros.srv_type.Request)
        self._responses = ownership_of(ros.srv_type.Response)

    def call(self, request: Any, *, is_held: bool) -> Future:
        """Hand a request over, and return the future of its response.

        Args:
            is_held: Whether somebody else refers to the request.
        """
        future = Future()
        taken = self._requests.take(request, is_held=is_held)
        self._inbox.put(_Request(taken, future, self._responses.take))
        return future


class _Request:
    """A request that was handed over."""

    __slots__ = ('_future', '_take', 'message')

    def __init__(self, message: Any, future: Future, take: Callable[..., Any]) -> None:
        self.message = message
        self._future = future
        self._take = take

    def respond(self, response: Any) -> None:
        """Take the response, which the server may have kept."""
        is_held = getrefcount(response) > _UNHELD
        if not self._future.done():
            self._future.set_result(self._take(response, is_held=is_held))


class _Probe:
    """Is responded to as a `_Request` is, and counts the references."""

    def respond(self, response: Any) -> int:
        return getrefcount(response)


_UNHELD: Final = _Probe().respond([None].copy())


class LocalClient(LocalEnd):
    """A service client of the system.

    Attributes:
        server: The server to which it hands requests; `None` if it sends them.
    """

    server: LocalService | None = None


class LocalServices:
    """The services of one system and their clients, by name in the graph and type."""

    def __init__(self, executor: ComposerExecutor) -> None:
        self._executor = executor
        self._servers: defaultdict[_Key, list[LocalService]] = defaultdict(list)
        self._clients: defaultdict[_Key, list[LocalClient]] = defaultdict(list)
        self._lock = threading.Lock()

    def add_server(self, node: Any, ros: RosService, name: str) -> LocalService:
        """Take in a service of an rclpy node, which `allow` connects."""
        inbox = self._executor.open_inbox(node, ros, queue_depth(ros.qos_profile))
        server = LocalService(node, ros, name, self._connect, inbox)
        with self._lock:
            self._servers[server.key].append(server)
        return server

    def add_client(self, node: Any, ros: RosClient, name: str) -> LocalClient:
        """Take in a service client of an rclpy node, which `allow` connects."""
        client = LocalClient(node, ros, name, self._connect)
        with self._lock:
            self._clients[client.key].append(client)
        return client

    def remove_server(self, server: LocalService) -> None:
        """Forget a service."""
        with self._lock:
            self._servers[server.key].remove(server)
        self._connect(server.key)

    def remove_client(self, client: LocalClient) -> None:
        """Forget a service client."""
        with self._lock:
            self._clients[client.key].remove(client)

    def forget(self, node: Any) -> None:
        """Forget all that belongs to an rclpy node."""
        with self._lock:
            gone = [each for known in self._servers.values() for each in known]
            gone = [each for each in gone if each.node is node]
            for clients in self._clients.values():
                clients[:] = [each for each in clients if each.node is not node]
        for server in gone:
            self.remove_server(server)

    def _connect(self, key: _Key) -> None:
        """Find out to which server each client of a name and a type hands its requests."""
        with self._lock:
            servers = self._servers[key]
            server = servers[0] if len(servers) == 1 and servers[0].is_local else None
            for client in self._clients[key]:
                meet = server is not None and client.is_local and _do_meet(client.ros, server.ros)
                client.server = server if meet else None


def _do_meet(client: RosClient, server: RosService) -> bool:
    asked, served = client.qos_profile, server.qos_profile
    checks = (qos_check_compatible(*each) for each in ((asked, served), (served, asked)))
    return all(compatibility != QoSCompatibility.ERROR for compatibility, _ in checks)
