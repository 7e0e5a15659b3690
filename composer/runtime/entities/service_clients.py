"""Service clients: `node.call` and `node.call_async`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.errors import (
    CallError,
    CallTimeoutError,
    ServiceFailedError,
    ServiceNotAvailableError,
)
from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.requests import Requests
from composer.runtime.behaviours.waits import WaitNotice
from composer.runtime.messages.payloads import converter_for
from composer.runtime.messages.qos_profiles import create_qos_profile

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.task import Future

    from composer.language.specs import ServiceClientSpec
    from composer.runtime.messages.local_services import LocalService
    from composer.runtime.nodes.behaviour_node import Payload
    from composer.runtime.nodes.live_node import LiveNode


class ServiceClient:
    """A client that converts payloads, and tells why a call failed."""

    def __init__(self, node: LiveNode, spec: ServiceClientSpec) -> None:
        service_class: Any = import_interface(spec.type)
        self._node = node
        self._failures = node.system.failures
        self._convert = converter_for(service_class.Request).convert
        self._service = node.ros.resolve_service_name(spec.service)
        self._service_class = service_class
        # Never in a group of behaviours: one that waits for a response would keep it out.
        self._client = node.ros.create_client(
            service_class,
            spec.service,
            qos_profile=create_qos_profile(spec.qos, node.system.profiles),
            callback_group=node.background,
        )
        self._requests = Requests(
            node.waits,
            self._is_available,
            WaitNotice(node.ros.get_logger().info, f"service '{self._service}'"),
            self._unavailable,
            self._unanswered,
            self._client.remove_pending_request,
        )

    def call(self, payload: Payload, timeout_sec: float | None) -> Any:
        """Send a request and return its response.

        Raises:
            PayloadError: The payload does not fit the request.
            CallError: There is no response; its subclasses say why.
            SystemStoppingError: A stop was requested while it waited.
        """
        return self._requests.send(self._sending(payload), timeout_sec)

    async def call_async(self, payload: Payload, timeout_sec: float | None) -> Any:
        """As `call`, without holding a thread while it waits."""
        return await self._requests.send_async(self._sending(payload), timeout_sec)

    def _sending(self, payload: Payload) -> Callable[[], Future]:
        """Return what sends a request, or hands it to a server of the same system."""
        request = self._convert(payload)
        is_held = request is payload

        def send() -> Future:
            local = self._find_local()
            if local is None:
                return self._client.call_async(request)
            return local.call(request, is_held=is_held)

        return send

    def _find_local(self) -> LocalService | None:
        return self._node.system.services.find(self._service, self._service_class)

    def _is_available(self) -> bool:
        return self._find_local() is not None or self._client.service_is_ready()

    def change(self, _spec: ServiceClientSpec) -> None:
        """See `LiveEntity`: all that it has is fixed."""

    def destroy(self) -> None:
        """See `LiveEntity`."""
        message = f"an edit took the client of '{self._service}' away, which this call waited for"
        self._requests.end(ServiceNotAvailableError(message))
        self._node.ros.destroy_client(self._client)

    def _unavailable(self, timeout_sec: float) -> CallError:
        message = f"no server of '{self._service}' appeared within {timeout_sec:g} s"
        return ServiceNotAvailableError(message, help='is it running, and is that its name?')

    def _unanswered(self, timeout_sec: float, begun: float) -> CallError:
        if self._failures.since(self._service, begun):
            message = f"'{self._service}' did not answer: its behaviour raised an error"
            return ServiceFailedError(message, help="the server's log has the traceback")
        message = f"'{self._service}' did not answer within {timeout_sec:g} s"
        return CallTimeoutError(message)
