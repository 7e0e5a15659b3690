"""Service clients: `node.call` and `node.call_async`."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.errors import (
    CallError,
    CallTimeoutError,
    ServiceFailedError,
    ServiceNotAvailableError,
)
from composer.interfaces.classes import import_interface
from composer.runtime.entities.qos_profiles import create_qos_profile
from composer.runtime.messages.payloads import converter_for

if TYPE_CHECKING:
    from rclpy.task import Future

    from composer.language.specs import ServiceClientSpec
    from composer.runtime.nodes.behaviour_node import Payload
    from composer.runtime.nodes.live_node import LiveNode


def create_service_clients(node: LiveNode) -> None:
    """Create the clients; behaviours reach them through `node.call`."""
    for spec in node.spec.service_clients.values():
        node.entities['service_clients'][spec.name] = ServiceClient(node, spec)


class ServiceClient:
    """A client that converts payloads and tells the ways apart in which a call can fail."""

    def __init__(self, node: LiveNode, spec: ServiceClientSpec) -> None:
        service_class: Any = import_interface(spec.type)
        self._node = node
        self._convert = converter_for(service_class.Request).convert
        self._service = node.ros.resolve_service_name(spec.service)
        # Never in a group of behaviours: one that waits for a response would keep it out.
        self._client = node.ros.create_client(
            service_class,
            spec.service,
            qos_profile=create_qos_profile(spec.qos, node.services.profiles),
            callback_group=node.background,
        )

    def call(self, payload: Payload, timeout_sec: float | None) -> Any:
        """Send a request and wait for its response.

        Raises:
            PayloadError: The payload does not fit the request.
            CallError: There is no response; its subclasses say why.
            SystemStoppingError: A stop was requested while it waited.
        """
        request = self._convert(payload)
        begun = monotonic()
        waits = self._node.waits
        if not waits.until_true(self._client.service_is_ready, timeout_sec):
            raise self._not_available(timeout_sec)
        future = self._client.call_async(request)
        try:
            if not waits.until_done(future, _remaining(timeout_sec, begun)):
                raise self._no_response(begun, timeout_sec)
        finally:
            self._forget(future)
        return future.result()

    async def call_async(self, payload: Payload, timeout_sec: float | None) -> Any:
        """As `call`, without holding a thread while it waits."""
        request = self._convert(payload)
        begun = monotonic()
        waits = self._node.coroutine_waits
        if not await waits.until_true(self._client.service_is_ready, timeout_sec):
            raise self._not_available(timeout_sec)
        future = self._client.call_async(request)
        try:
            if not await waits.until_done(future, _remaining(timeout_sec, begun)):
                raise self._no_response(begun, timeout_sec)
        finally:
            self._forget(future)
        return future.result()

    def is_ready(self) -> bool:
        """Return whether there is a server now."""
        return bool(self._client.service_is_ready())

    def _not_available(self, timeout_sec: float | None) -> ServiceNotAvailableError:
        message = f"no server of '{self._service}' appeared within {timeout_sec:g} s"
        return ServiceNotAvailableError(message, help='is it running, and is that its name?')

    def _forget(self, future: Future) -> None:
        if not future.done():
            self._client.remove_pending_request(future)

    def _no_response(self, begun: float, timeout_sec: float | None) -> CallError:
        if self._node.services.failures.since(self._service, begun):
            message = f"'{self._service}' did not answer: its behaviour raised an error"
            return ServiceFailedError(message, help="the server's log has the traceback")
        message = f"'{self._service}' did not answer within {timeout_sec:g} s"
        return CallTimeoutError(message)


def _remaining(timeout_sec: float | None, begun: float) -> float | None:
    if timeout_sec is None:
        return None
    return max(begun + timeout_sec - monotonic(), 0.0)
