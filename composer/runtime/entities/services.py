"""Services: each request goes to a behaviour, and what it returns is the response."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.errors import ServiceNotAvailableError
from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.calls import FAILED
from composer.runtime.behaviours.requests import NoResponseError, failed_call
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.messages.delivery_policies import queue_depth
from composer.runtime.messages.payloads import converter_for
from composer.runtime.messages.qos_profiles import configure_introspection, create_qos_profile
from composer.runtime.nodes.callback_groups import LifecycleGate

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.errors import CallError
    from composer.language.specs import Introspection, ServiceSpec
    from composer.runtime.nodes.live_node import LiveNode


class Service:
    """A service that the node serves."""

    def __init__(self, node: LiveNode, spec: ServiceSpec) -> None:
        self._node = node
        self._ros = node.ros.create_service(
            import_interface(spec.type),
            spec.service,
            _create_callback(node, spec),
            qos_profile=create_qos_profile(spec.qos, node.system.profiles),
            callback_group=node.group(spec.group),
        )
        key = node.ros.resolve_service_name(spec.service), self._ros.srv_type
        self._local = node.system.services.add_server(
            node.ros, self._ros, key, queue_depth(self._ros.qos_profile)
        )
        self._local.allow(is_allowed=spec.local_delivery)
        self._introspection: Introspection = 'off'
        self._introspect(spec.introspection)
        self._rest(spec)

    def change(self, spec: ServiceSpec) -> None:
        """See `LiveEntity`."""
        self._ros.callback = _create_callback(self._node, spec)
        self._local.allow(is_allowed=spec.local_delivery)
        self._introspect(spec.introspection)
        self._rest(spec)

    def _introspect(self, introspection: Introspection) -> None:
        if introspection != self._introspection:
            self._introspection = introspection
            configure_introspection(self._node.ros, self._ros, introspection)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self._node.system.services.remove(self._local)
        self._node.ros.destroy_service(self._ros)

    def _rest(self, spec: ServiceSpec) -> None:
        """Have requests kept or dropped while the node is not active."""
        gate = self._node.gate
        if isinstance(gate, LifecycleGate):
            is_dropped = spec.while_inactive != 'keep'
            gate.drop(self._ros, is_dropped=is_dropped)
            self._local.find_refusal = self._find_refusal if is_dropped else None

    def _find_refusal(self) -> str:
        node = self._node
        if node.lifecycle is None or not (node.gate.rests and node.gate.serves):
            return ''
        return f"node '{node.spec.key}' is {node.lifecycle.state}"


def _create_callback(node: LiveNode, spec: ServiceSpec) -> Callable[..., Any]:
    service_class: Any = import_interface(spec.type)
    owner = Owner('service', spec.name)
    call = node.call(
        owner,
        spec.path,
        node.bind(spec.behaviour, owner),
        options=spec,
        deliver=converter_for(service_class.Response).convert,
        may_begin=node.gate.allows_requests,
    )
    run, full_name = call.run, node.ros.resolve_service_name(spec.service)

    tell, node_name = node.system.tell, node.full_name

    def checked(response: Any) -> Any:
        if response is not FAILED:
            tell('response', node_name, full_name, response)
            return response
        raise NoResponseError(_find_answer(node, full_name, owner))

    def serve(request: Any, _response: Any) -> Any:
        tell('request', node_name, full_name, request)
        return checked(FAILED if node.gate.rests else run(request))

    async def serve_async(request: Any, _response: Any) -> Any:
        tell('request', node_name, full_name, request)
        return checked(FAILED if node.gate.rests else await run(request))

    return serve_async if call.is_async else serve


def _find_answer(node: LiveNode, full_name: str, owner: Owner) -> CallError:
    """Return what a call raises whose request has no response."""
    reason = ''
    if isinstance(node.gate, LifecycleGate) and node.gate.rests and node.lifecycle is not None:
        _tell_refusal(node, node.gate, owner)
        reason = f"node '{node.spec.key}' is {node.lifecycle.state}"
    elif not node.gate.serves:
        reason = f"node '{node.spec.key}' stops"
    if reason:
        return ServiceNotAvailableError(f"'{full_name}' answers no requests: {reason}")
    return failed_call(full_name)


def _tell_refusal(node: LiveNode, gate: LifecycleGate, owner: Owner) -> None:
    """Log that a request is not answered, once until the node is active."""
    if node.lifecycle is not None and str(owner) not in gate.has_refused:
        gate.has_refused.add(str(owner))
        text = f'{owner} answers no requests: the node is {node.lifecycle.state}'
        node.ros.get_logger().warning(text)
