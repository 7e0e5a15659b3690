"""The ends of any node on the ROS graph: found, heard, called and set."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.names import join_names
from composer.runtime.messages.payload_texts import read_parameter
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node
    from rclpy.subscription import Subscription
    from rclpy.task import Future

    from composer.application.running_systems.client import Client

_POLL_SEC = 0.05


class LiveGraph:
    """The ROS graph, as long as nobody asks to stop.

    Args:
        timeout_sec: How long something may take to be found, and to answer.
    """

    def __init__(
        self, client: Client, timeout_sec: float, is_asked: Callable[[], bool] = lambda: False
    ) -> None:
        self.node: Node = client.node
        self.is_asked = is_asked
        self.timeout_sec = timeout_sec
        self._executor = client.executor

    def spin(self) -> None:
        """Let something happen."""
        self._executor.spin_once(timeout_sec=_POLL_SEC)

    def wait_for(self, condition: Callable[[], Any], *, is_endless: bool = False) -> Any:
        """Return the first true result of a condition; the last one if time is over."""
        deadline = monotonic() + self.timeout_sec
        while not (found := condition()) and not self.is_asked():
            if monotonic() > deadline and not is_endless:
                break
            self.spin()
        return found

    def result(self, future: Future, missing: str) -> Any:
        """Return what a future brings.

        Raises:
            ComposerError: It did not come in time.
        """
        if not self.wait_for(future.done):
            message = missing if not self.is_asked() else 'interrupted'
            raise ComposerError(message)
        return future.result()

    def names(self, kind: str) -> dict[str, list[str]]:
        """Return the full names of all of a kind, each with its types; a node has none."""
        if kind == 'action':
            from rclpy.action import get_action_names_and_types

            return dict(get_action_names_and_types(self.node))
        if kind == 'node':
            pairs = self.node.get_node_names_and_namespaces()
            return {join_names(namespace, name): [] for name, namespace in pairs}
        return dict(getattr(self.node, f'get_{kind}_names_and_types')())

    def find(self, kind: str, name: str) -> tuple[str, Any]:
        """Return the full name and the class of a topic, a service or an action.

        Raises:
            ComposerError: There is none, it has several types, or its type is not installed.
        """
        from composer.interfaces.classes import import_interface
        from composer.recordings.definitions import import_message

        name = f'/{name.lstrip("/")}'
        types: list[str] = self.wait_for(lambda: self.names(kind).get(name)) or []
        if len(types) > 1:
            message = f"the {kind} '{name}' has several types: {', '.join(types)}"
            raise ComposerError(message)
        if not types:
            raise self._missing(kind, name)
        return name, (import_message if kind == 'topic' else import_interface)(types[0])

    def find_node(self, node: str) -> str:
        """Return the full name of a node.

        Args:
            node: Its full name, or what follows the last slash of it.

        Raises:
            ComposerError: There is none, or there are several.
        """

        def meant() -> list[str]:
            return [each for each in self.names('node') if node in (each, each.rpartition('/')[2])]

        found: list[str] = self.wait_for(meant)
        if len(found) > 1:
            message = f"several nodes have the name '{node}': {', '.join(found)}"
            raise ComposerError(message, help='write the full name of one')
        if not found:
            error = self._missing('node', node)
            raise error
        return found[0]

    def _missing(self, kind: str, name: str) -> ComposerError:
        if self.is_asked():
            return ComposerError('interrupted')
        message = f"there is no {kind} '{name}' on this ROS graph"
        return ComposerError(message, help=suggest(name, self.names(kind), 'there are'))

    def subscribe(
        self, topic: str, message_class: type, take: Callable[[Any], object]
    ) -> Subscription:
        """Return a subscription with a QoS that matches all publishers."""
        from composer.recordings.graph_recorder import match_offers, read_offer

        ends = self.node.get_publishers_info_by_topic(topic)
        profile = match_offers(read_offer(each.qos_profile) for each in ends)
        return self.node.create_subscription(message_class, topic, take, profile)

    def call(self, service: str, service_class: Any, request: Any) -> Any:
        """Return the answer of a service.

        Args:
            service: Its full name.

        Raises:
            ComposerError: It did not answer in time.
        """
        ros = self.node.create_client(service_class, service)
        silent = f"the service '{service}' did not answer within {self.timeout_sec:g} s"
        try:
            if not self.wait_for(ros.service_is_ready):
                raise ComposerError(silent)
            return self.result(ros.call_async(request), silent)
        finally:
            self.node.destroy_client(ros)

    def set_parameter(self, node: str, name: str, text: str) -> None:
        """Set a parameter of a node to a value in YAML; see `find_node`.

        Raises:
            ComposerError: There is no such node or parameter, or the node refuses the value.
        """
        from rcl_interfaces.srv import GetParameterTypes, ListParameters, SetParameters

        full_name = self.find_node(node)
        asked = GetParameterTypes.Request(names=[name])
        types = self.call(f'{full_name}/get_parameter_types', GetParameterTypes, asked).types
        if not any(types):
            listed = ListParameters.Request()
            names = self.call(f'{full_name}/list_parameters', ListParameters, listed).result.names
            message = f"'{full_name}' has no parameter '{name}'"
            raise ComposerError(message, help=suggest(name, names, 'it has'))
        request = SetParameters.Request(parameters=[read_parameter(name, text, types[0])])
        [result] = self.call(f'{full_name}/set_parameters', SetParameters, request).results
        if not result.successful:
            reason = result.reason or 'without a reason'
            message = f"'{full_name}' refuses {name} = {text}: {reason}"
            raise ComposerError(message)
