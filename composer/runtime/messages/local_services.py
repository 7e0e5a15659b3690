"""Requests to services and actions of the system are handed over, and so are the responses.

A call is sent as before if the client and the server would not meet, if somebody else of the
system serves the same name, and while the client or the server is introspected: the events of
service introspection come from the middleware.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from contextlib import suppress
from sys import getrefcount
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.task import Future

from composer.errors import ServiceNotAvailableError
from composer.runtime.behaviours.requests import failed_call
from composer.runtime.messages.delivery_policies import are_compatible, why_sent
from composer.runtime.messages.ownership import ownership_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.qos import QoSProfile

    from composer.executor import ComposerExecutor
    from composer.executor.sources.inbox import Inbox

# The name in the graph, and the type.
_Key: TypeAlias = 'tuple[str, type]'


class LocalEnd:
    """A server or a client of the system, of a service or an action.

    Args:
        node: The rclpy node that it belongs to.
        connect: Called with the key when it may be connected otherwise.

    Attributes:
        ros: What rclpy has for it.
        key: Its name in the graph, and the type.
    """

    def __init__(self, node: Any, ros: Any, key: _Key, connect: Callable[[_Key], None]) -> None:
        self.node = node
        self.ros = ros
        self.key = key
        self._connect = connect
        self._is_allowed = True
        self._is_introspected = False
        # Before rclpy 9, actions have none.
        self._configure = getattr(ros, 'configure_introspection', None)
        if self._configure is not None:
            ros.configure_introspection = self._configure_introspection

    @property
    def profile(self) -> QoSProfile | None:
        """The QoS; of actions, it is the same for all."""
        return getattr(self.ros, 'qos_profile', None)

    @property
    def own_reason(self) -> str:
        """Why its requests are sent; empty if they may be handed over."""
        if not self._is_allowed:
            return 'local_delivery: false'
        if self._is_introspected:
            return 'introspection'
        return '' if self.profile is None else why_sent(self.profile)

    def allow(self, *, is_allowed: bool) -> None:
        """Let its requests be handed over, or have all of them sent."""
        self._is_allowed = is_allowed
        self._connect(self.key)

    def _configure_introspection(self, clock: Any, qos: QoSProfile, state: Any) -> None:
        if self._configure is not None:
            self._configure(clock, qos, state)
        self._is_introspected = state != ServiceIntrospectionState.OFF
        self._connect(self.key)


class LocalServer(LocalEnd):
    """A server of the system.

    Attributes:
        inbox: Takes requests: objects as `executor.open_inbox` says.
        clients: How many clients of the system have its name and type.
        is_gone: Whether it was removed: what still waits for it is dropped.
        find_refusal: Returns why it refuses requests now, or an empty string; `None` if it never
            does.
    """

    inbox: Inbox
    clients = 0
    is_gone = False
    find_refusal: Callable[[], str] | None = None
    executor: ComposerExecutor

    def call(self, request: Any, *, is_held: bool, may_block: bool = False) -> Future:
        """Hand a request to a service over, and return the future of its response.

        Args:
            is_held: Whether somebody else refers to the request.
            may_block: Whether the service may be executed here and now: that spares two changes
                of threads, which cost more than all the rest, but nothing ends it in time.
        """
        service_class = self.ros.srv_type
        future = Future()
        taken = ownership_of(service_class.Request).take(request, is_held=is_held)
        request = _Request(taken, future, ownership_of(service_class.Response).take, self.key[0])
        if not (may_block and self.executor.execute_at_once(self.inbox, request)):
            self.inbox.put(request)
        if self.is_gone:
            self.inbox.messages.clear()
        return future


class _Request:
    """A request that was handed over."""

    __slots__ = ('_future', '_service', '_take', 'message')

    def __init__(
        self, message: Any, future: Future, take: Callable[..., Any], service: str
    ) -> None:
        self.message = message
        self._future = future
        self._take = take
        self._service = service

    def respond(self, response: Any) -> None:
        """Take the response, which the server may have kept."""
        is_held = getrefcount(response) > _UNHELD
        if not self._future.done():
            self._future.set_result(self._take(response, is_held=is_held))

    def fail(self, error: BaseException) -> None:
        """Let who waits know why there is no response."""
        if not self._future.done():
            self._future.set_exception(failed_call(self._service, error))

    def __del__(self) -> None:
        # It was pushed out of a full queue, or its server was removed: nobody will answer it.
        if not self._future.done():
            reason = 'its queue was full, or it was removed'
            message = f"'{self._service}' dropped this request: {reason}"
            self._future.set_exception(ServiceNotAvailableError(message))


class _Probe:
    """Is responded to as a `_Request` is, and counts the references."""

    def respond(self, response: Any) -> int:
        return getrefcount(response)


_UNHELD: Final = _Probe().respond([None].copy())


class LocalClient(LocalEnd):
    """A client of the system.

    Attributes:
        server: The server to which it hands requests; `None` if it sends them.
        reason: Why it sends them.
    """

    server: LocalServer | None = None
    reason = ''

    def delivery(self) -> tuple[str, str]:
        """Return which way requests go now, `local` or `sent`, and why they are sent."""
        return ('sent', self.reason) if self.server is None else ('local', '')


class LocalServices:
    """The services and actions of one system and their clients."""

    def __init__(self, executor: ComposerExecutor) -> None:
        self._executor = executor
        self._servers: defaultdict[_Key, list[LocalServer]] = defaultdict(list)
        self._clients: defaultdict[_Key, list[LocalClient]] = defaultdict(list)
        self._lock = threading.Lock()

    def add_server(self, node: Any, ros: Any, key: _Key, depth: int | None) -> LocalServer:
        """Take in a server of an rclpy node, which `allow` connects.

        Args:
            key: Its name in the graph, and the type.
            depth: How many requests wait for it; `None` for any number.
        """
        server = LocalServer(node, ros, key, self._connect)
        server.executor = self._executor
        server.inbox = self._executor.open_inbox(node, ros, depth)
        with self._lock:
            self._servers[key].append(server)
        return server

    def add_client(self, node: Any, ros: Any, key: _Key) -> LocalClient:
        """Take in a client of an rclpy node, which `allow` connects."""
        client = LocalClient(node, ros, key, self._connect)
        with self._lock:
            self._clients[key].append(client)
        return client

    def remove(self, end: LocalEnd) -> None:
        """Forget a server or a client."""
        known: Any = self._servers if isinstance(end, LocalServer) else self._clients
        with self._lock, suppress(ValueError):
            known[end.key].remove(end)
        self._connect(end.key)
        if isinstance(end, LocalServer):
            end.is_gone = True
            end.inbox.messages.clear()

    def forget(self, node: Any) -> None:
        """Forget all that belongs to an rclpy node."""
        with self._lock:
            servers = [each for known in self._servers.values() for each in known]
            clients = [each for known in self._clients.values() for each in known]
        for end in (*servers, *clients):
            if end.node is node:
                self.remove(end)

    def _connect(self, key: _Key) -> None:
        """Find out to which server each client of a name and a type hands its requests."""
        with self._lock:
            servers, clients = self._servers[key], self._clients[key]
            for server in servers:
                server.clients = len(clients)
            for client in clients:
                client.reason = client.own_reason or _why_sent(client, servers)
                client.server = None if client.reason else servers[0]


def _why_sent(client: LocalClient, servers: list[LocalServer]) -> str:
    if len(servers) != 1:
        return 'several servers' if servers else 'its server is outside'
    if not _do_meet(client, servers[0]):
        return 'its QoS and that of the server do not match'
    return servers[0].own_reason


def _do_meet(client: LocalClient, server: LocalServer) -> bool:
    asked, served = client.profile, server.profile
    if asked is None or served is None:
        return True
    return are_compatible(asked, served) and are_compatible(served, asked)
