"""Services: each request goes to a behaviour, and what it returns is the response."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.interfaces.classes import import_interface
from composer.python_source.modules import FunctionKind
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.calls import Owner
from composer.runtime.entities.qos_profiles import create_qos_profile
from composer.runtime.messages.payloads import converter_for
from composer.runtime.system_executor import NoResponseError

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import ServiceSpec
    from composer.runtime.nodes.live_node import LiveNode


def create_services(node: LiveNode) -> None:
    """Create the services that the node serves."""
    for spec in node.spec.services.values():
        node.ros.create_service(
            import_interface(spec.type),
            spec.service,
            _create_callback(node, spec),
            qos_profile=create_qos_profile(spec.qos, node.services.profiles),
            callback_group=node.group(spec.group),
        )


def _create_callback(node: LiveNode, spec: ServiceSpec) -> Callable[..., Any]:
    service_class: Any = import_interface(spec.type)
    convert = converter_for(service_class.Response).convert
    function = node.bind(spec.behaviour)
    owner = Owner('service', spec.name)
    call = node.call(owner, spec.path, function, rules=spec, admits=node.gate.lets_requests)
    full_name = node.ros.resolve_service_name(spec.service)
    failures = node.services.failures

    def answering(responses: list[Any]) -> Any:
        """Return the call for one request; its response is appended to `responses`."""
        return call.delivering(lambda payload: responses.append(convert(payload)))

    def response_of(responses: list[Any]) -> Any:
        if responses:
            return responses[0]
        if node.gate.serves:
            failures.note(full_name)
        message = f'{owner} of {node.spec.key} has no response'
        raise NoResponseError(message)

    if kind_of(function) is FunctionKind.COROUTINE:

        async def serve_async(request: Any, _response: Any) -> Any:
            responses: list[Any] = []
            await answering(responses).as_callback(FunctionKind.COROUTINE)(request)
            return response_of(responses)

        return serve_async

    def serve(request: Any, _response: Any) -> Any:
        responses: list[Any] = []
        answering(responses).run(request)
        return response_of(responses)

    return serve
