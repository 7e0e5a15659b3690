"""The parameters of other nodes, through their parameter services."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python

from composer.errors import (
    CallTimeoutError,
    ParametersRefusedError,
    ServiceNotAvailableError,
)
from composer.names import join_names
from composer.runtime.behaviours.requests import Requests
from composer.runtime.behaviours.waits import WaitNotice

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from rclpy.callback_groups import CallbackGroup
    from rclpy.client import Client
    from rclpy.node import Node

    from composer.runtime.behaviours.waits import Waits


class RemoteParameters:
    """Gets and sets parameters of any node of the graph.

    Args:
        ros: The node that asks.
        namespace: Where relative names of nodes lie.
        group: The callback group of its clients.
        without_services: The full names of the system's nodes without parameter services.
    """

    def __init__(
        self,
        ros: Node,
        namespace: str,
        waits: Waits,
        group: CallbackGroup,
        without_services: Collection[str],
    ) -> None:
        self._ros = ros
        self._namespace = namespace
        self._waits = waits
        self._group = group
        self._without_services = without_services
        self._clients: dict[str, tuple[Client, Requests]] = {}

    def set(self, node_name: str, values: Mapping[str, Any], timeout_sec: float | None) -> None:
        """Set parameters of a node.

        Raises:
            ServiceNotAvailableError: The node did not appear in time, or has no such services.
            CallTimeoutError: It did not answer in time.
            ParametersRefusedError: It refused; the message has its reasons.
        """
        parameters = [
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]
        request = SetParameters.Request(parameters=parameters)
        response = self._call(node_name, SetParameters, 'set_parameters', request, timeout_sec)
        refusals = [
            f"'{name}': {result.reason}"
            for name, result in zip(values, response.results, strict=True)
            if not result.successful
        ]
        if refusals:
            message = f"node '{node_name}' refused {'; '.join(refusals)}"
            raise ParametersRefusedError(message)

    def get(
        self, node_name: str, names: Iterable[str], timeout_sec: float | None
    ) -> dict[str, Any]:
        """Return the values of a node's parameters; `None` for one that is not set.

        Raises:
            ServiceNotAvailableError: The node did not appear in time, or has no such services.
            CallTimeoutError: It did not answer in time.
            ParametersRefusedError: It has no such parameters.
        """
        wanted = list(names)
        request = GetParameters.Request(names=wanted)
        response = self._call(node_name, GetParameters, 'get_parameters', request, timeout_sec)
        if len(response.values) != len(wanted):
            message = f"node '{node_name}' does not have all of {', '.join(wanted)}"
            raise ParametersRefusedError(message)
        values = map(parameter_value_to_python, response.values)
        return dict(zip(wanted, values, strict=True))

    def lose_servers(self) -> None:
        """End the requests to nodes that were killed."""
        for _, requests in list(self._clients.values()):
            requests.lose()

    def _call(
        self, node_name: str, kind: Any, service: str, request: Any, timeout_sec: float | None
    ) -> Any:
        full_name = node_name
        if not node_name.startswith('/'):
            full_name = join_names(self._namespace, node_name)
        if full_name in self._without_services:
            message = f"node '{full_name}' has no parameter services"
            advice = "write 'parameter_services: true' where the file declares it"
            raise ServiceNotAvailableError(message, help=advice)
        service_name = join_names(full_name, service)
        # A client is kept: to make one and find its server takes longer than the call.
        if service_name not in self._clients:
            self._clients[service_name] = self._create_client(kind, service_name, full_name)
        client, requests = self._clients[service_name]
        return requests.send(partial(client.call_async, request), timeout_sec)

    def _create_client(
        self, kind: Any, service_name: str, full_name: str
    ) -> tuple[Client, Requests]:
        def unavailable(timeout_sec: float) -> ServiceNotAvailableError:
            message = (
                f"no node '{full_name}' with parameter services appeared within {timeout_sec:g} s"
            )
            return ServiceNotAvailableError(message)

        def unanswered(timeout_sec: float) -> CallTimeoutError:
            message = f"node '{full_name}' did not answer within {timeout_sec:g} s"
            return CallTimeoutError(message)

        def lost() -> ServiceNotAvailableError:
            return ServiceNotAvailableError(f"node '{full_name}' ended before it answered")

        client = self._ros.create_client(kind, service_name, callback_group=self._group)
        requests = Requests(
            self._waits,
            client.service_is_ready,
            WaitNotice(
                self._ros.get_logger().info, f"the parameter services of node '{full_name}'"
            ),
            unavailable,
            unanswered,
            lost,
            client.remove_pending_request,
        )
        return client, requests
