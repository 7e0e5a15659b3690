"""Service clients: `node.call` and `node.call_async`."""

from __future__ import annotations

import threading
from contextlib import suppress
from functools import partial
from sys import getrefcount
from time import time_ns
from typing import TYPE_CHECKING, Any, Final
from weakref import WeakKeyDictionary

from composer.errors import (
    CallError,
    CallTimeoutError,
    ServiceNotAvailableError,
)
from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.requests import Requests
from composer.runtime.behaviours.waits import WaitNotice
from composer.runtime.messages.payloads import converter_for
from composer.runtime.messages.qos_profiles import configure_introspection, create_qos_profile

if TYPE_CHECKING:
    from rclpy.task import Future

    from composer.language.specs import Introspection, ServiceClientSpec
    from composer.runtime.behaviours.requests import RequestFailure
    from composer.runtime.nodes.behaviour_node import Payload
    from composer.runtime.nodes.live_node import LiveNode


# Fast DDS counts the fractions of a second otherwise.
_STAMP_NS = 1000


class ServiceClient:
    """A client that converts payloads, and tells why a call failed."""

    def __init__(self, node: LiveNode, spec: ServiceClientSpec) -> None:
        service_class: Any = import_interface(spec.type)
        self._node = node
        self._convert = converter_for(service_class.Request).convert
        self._service = node.ros.resolve_service_name(spec.service)
        # Never in a group of behaviours: one that waits for a response would keep it out.
        self._client = node.ros.create_client(
            service_class,
            spec.service,
            qos_profile=create_qos_profile(spec.qos, node.system.profiles),
            callback_group=node.background,
        )
        self._local = node.system.services.add_client(
            node.ros, self._client, (self._service, service_class)
        )
        self._local.allow(is_allowed=spec.local_delivery)
        self._introspection: Introspection = 'off'
        self._introspect(spec.introspection)
        # When those that were sent over the middleware were: after one time, before the other.
        self._sent: WeakKeyDictionary[Future, tuple[int, int]] = WeakKeyDictionary()
        self._sending = threading.Lock()
        self._requests = Requests(
            node.waits,
            self._is_available,
            WaitNotice(node.ros.get_logger().info, f"service '{self._service}'"),
            self._unavailable,
            self._unanswered,
            self._lost,
            self._client.remove_pending_request,
        )

    def call(self, payload: Payload, timeout_sec: float | None) -> Any:
        """Send a request and return its response.

        Raises:
            PayloadError: The payload does not fit the request.
            CallError: There is no response; its subclasses say why.
            SystemStoppingError: A stop was requested while it waited.
        """
        request = self._convert(payload)
        is_held = request is payload and getrefcount(payload) > _UNHELD
        may_block = timeout_sec is None and not self._node.system.stop.is_set
        send = partial(self._send, request, is_held=is_held, may_block=may_block)
        return self._requests.send(send, timeout_sec)

    async def call_async(self, payload: Payload, timeout_sec: float | None) -> Any:
        """As `call`, without holding a thread while it waits."""
        request = self._convert(payload)
        is_held = request is payload and getrefcount(payload) > _UNHELD_ASYNC
        send = partial(self._send, request, is_held=is_held)
        return await self._requests.send_async(send, timeout_sec)

    def _send(self, request: Any, *, is_held: bool, may_block: bool = False) -> Future:
        server = self._local.server
        if server is None:
            with self._sending:
                begun_ns = time_ns() - _STAMP_NS
                future = self._client.call_async(request)
                self._sent[future] = begun_ns, time_ns() + _STAMP_NS
            return future
        if server.find_refusal is not None and (reason := server.find_refusal()):
            message = f"'{self._service}' answers no requests: {reason}"
            raise ServiceNotAvailableError(message)
        return server.call(request, is_held=is_held, may_block=may_block)

    def _is_available(self) -> bool:
        return self._local.server is not None or self._client.service_is_ready()

    def delivery(self) -> tuple[str, str, int]:
        """Return which way requests go now, why, and how many; see `LocalClient.delivery`."""
        return *self._local.delivery(), self._requests.sent

    def change(self, spec: ServiceClientSpec) -> None:
        """See `LiveEntity`."""
        self._local.allow(is_allowed=spec.local_delivery)
        self._introspect(spec.introspection)

    def _introspect(self, introspection: Introspection) -> None:
        if introspection != self._introspection:
            self._introspection = introspection
            configure_introspection(self._node.ros, self._client, introspection)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        message = f"an edit took the client of '{self._service}' away, which this call waited for"
        self._requests.end(ServiceNotAvailableError(message))
        self._node.system.services.remove(self._local)
        self._node.ros.destroy_client(self._client)

    def lose_server(self) -> None:
        """End the calls that wait for an answer, if the server was killed."""
        self._requests.lose()

    def _lost(self) -> ServiceNotAvailableError:
        return ServiceNotAvailableError(
            f"the server of '{self._service}' ended before it answered"
        )

    def fail_request(self, failure: RequestFailure) -> bool:
        """End the call that waits for the response to a request; return whether it is here."""
        if failure.service != self._service:
            return False
        with self._sending, suppress(KeyError):
            future = self._client.get_pending_request(failure.sequence)
            first_ns, last_ns = self._sent[future]
            is_it = failure.sent_ns is None or first_ns <= failure.sent_ns <= last_ns
            if is_it and not future.done():
                future.set_exception(failure.error)
                return True
        return False

    def _unavailable(self, timeout_sec: float) -> CallError:
        message = f"no server of '{self._service}' appeared within {timeout_sec:g} s"
        return ServiceNotAvailableError(message, help='is it running, and is that its name?')

    def _unanswered(self, timeout_sec: float) -> CallError:
        message = f"'{self._service}' did not answer within {timeout_sec:g} s"
        return CallTimeoutError(message)


class _Probe:
    """Calls as those on the way of a payload to its client, which count its references."""

    def call_by_name(self, _name: str, payload: Any, timeout: float | None) -> int:
        client = self
        return client.call({} if payload is None else payload, timeout)

    def call(self, payload: Any, _timeout_sec: float | None) -> int:
        request = payload
        return 0 if request is None else getrefcount(payload)

    async def call_async_by_name(self, _name: str, payload: Any, timeout: float | None) -> int:  # noqa: ASYNC109 - as `Node.call_async`
        client = self
        return await client.call_async({} if payload is None else payload, timeout)

    async def call_async(self, payload: Any, _timeout_sec: float | None) -> int:
        request = payload
        return 0 if request is None else getrefcount(payload)


def _count_async() -> int:
    try:
        _Probe().call_async_by_name('', [None], None).send(None)
    except StopIteration as end:
        return int(end.value)
    return 0


# The references to a payload in `ServiceClient.call` that only `Node.call` was given.
_UNHELD: Final = _Probe().call_by_name('', [None], None)
_UNHELD_ASYNC: Final = _count_async()
