"""What a test does with a simulated system: a node of its own, beside those of the system."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile

from composer.errors import ComposerError, ParametersRefusedError
from composer.names import expand_name
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from types import SimpleNamespace

    from rclpy.publisher import Publisher

    from composer.runtime.nodes.goals import Goal
    from composer.runtime.nodes.live_node import LiveNode

DRIVER: Final = 'scenario'
_SECTIONS: Final = {
    'topic': ('publishers', 'subscriptions'),
    'service': ('services', 'service_clients'),
    'action': ('actions', 'action_clients'),
}
_DEPTH: Final = 1000


# pytest shows where a test failed, and nothing of this module.
__tracebackhide__ = True


class SimulationError(ComposerError):
    """A test asks for something that the simulated system does not have."""

    def __str__(self) -> str:
        """Return the message with its help: a failed test shows only this."""
        return f'{super().__str__()}: {self.help}' if self.help else super().__str__()


class SimulatedGoal:
    """A goal that a test has sent, and the server has accepted.

    Attributes:
        goal: The goal as a behaviour would see it.
    """

    def __init__(self, goal: Goal) -> None:
        self.goal = goal
        self._feedback: list[Any] = []

    @property
    def feedback(self) -> list[Any]:
        """The feedback messages that have come so far."""
        queue = self.goal.feedback_queue
        while not queue.empty():
            message = queue.get_nowait()
            if message is not None:
                self._feedback.append(message)
        return self._feedback

    @property
    def status(self) -> str:
        """The state of the goal: `executing`, `succeeded`, `canceled`, `aborted`, and so on."""
        return self.goal.status

    @property
    def result(self) -> Any:
        """The result message; `None` until the goal has ended."""
        future = self.goal.result_future
        return future.result().result if future.done() else None

    def cancel(self, timeout: float | None = 5.0) -> bool:
        """Ask the server to cancel the goal; return whether it agreed.

        Raises:
            GoalTimeoutError: It did not answer in time.
        """
        return self.goal.cancel(timeout)


class _Refusal:
    """Accepts no goal."""

    async def complete(self, _goal: Any) -> bool:
        return False


class ScenarioNode:
    """Publishes, calls and serves for a test, through a node of the simulated system.

    Args:
        nodes: All nodes, by their full names, with its own.
    """

    def __init__(self, nodes: Mapping[str, LiveNode]) -> None:
        self._nodes = nodes
        # Of nodes that have ended, by kind and full name.
        self._types: dict[tuple[str, str], str] = {}
        self._node = nodes[f'/{DRIVER}']
        self._made: dict[tuple[str, str], Any] = {}
        # Others may ask it before anything else has started.
        self._node.serve_at_once()
        # A client that comes later gets the status of goals from a thread of the middleware, in
        # real time: that is one more choice for a shuffle, or none.
        for node in nodes.values():
            for spec in node.spec.actions.values():
                self._client_of(_resolve(node, spec, 'action'), spec.type)

    def create_log_publisher(self) -> Publisher:
        """Return a publisher of `/rosout`, as each node of rclpy has one."""
        profile = QoSProfile(depth=_DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        return self._node.ros.create_publisher(Log, '/rosout', profile)

    # Topics, services, actions

    def publish(self, topic: str, payload: Any, of_type: str | None) -> None:
        """Publish a payload, on a topic of the system or a new one.

        Raises:
            SimulationError: Nobody has the topic, and no type is given.
            PayloadError: The payload does not fit the type.
        """
        name = _full(topic)
        publisher = self._made.get(('publishers', name))
        if publisher is None:
            type_name = of_type or self._type_of(name, 'topic')
            publisher = self._make(
                'publishers', {'type': type_name, 'topic': name, 'qos': self._qos_for(name)}
            )
        publisher.publish(payload)

    def call(self, service: str, request: Any, timeout: float | None, of_type: str | None) -> Any:
        """Call a service and return its response.

        Raises:
            SimulationError: Nobody has the service, and no type is given.
            PayloadError: The payload does not fit the request.
            CallError: There is no response; its subclasses say why.
        """
        name = _full(service)
        client = self._made.get(('service_clients', name))
        if client is None:
            type_name = of_type or self._type_of(name, 'service')
            client = self._make('service_clients', {'type': type_name, 'service': name})
        return client.call({} if request is None else request, timeout)

    def send_goal(
        self, action: str, goal: Any, timeout: float | None, of_type: str | None
    ) -> SimulatedGoal:
        """Send a goal, and return it when it is accepted.

        Raises:
            SimulationError: Nobody has the action, and no type is given.
            PayloadError: The payload does not fit the goal.
            ActionNotAvailableError: No server appeared in time.
            GoalTimeoutError: It did not answer in time.
            GoalRejectedError: It refused the goal.
        """
        client = self._client_of(_full(action), of_type)
        return SimulatedGoal(client.send_goal({} if goal is None else goal, timeout))

    def _client_of(self, action: str, of_type: str | None) -> Any:
        client = self._made.get(('action_clients', action))
        if client is None:
            type_name = of_type or self._type_of(action, 'action')
            client = self._make('action_clients', {'type': type_name, 'action': action})
        return client

    def serve(self, service: str, answer: Callable[[Any], Any], of_type: str | None) -> None:
        """Serve a service that the system calls: `answer` returns the payload of the response."""
        name = _full(service)
        type_name = of_type or self._type_of(name, 'service')
        data = {'type': type_name, 'service': name, 'group': 'reentrant'}
        self._make('services', data, lambda _node, request: answer(request))

    def serve_action(
        self,
        action: str,
        execute: Callable[[Any], Iterator[Any]],
        of_type: str | None,
        *,
        accepts: bool,
    ) -> None:
        """Serve an action: `execute` yields feedback payloads, and returns that of the result."""

        def behave(_node: Any, goal: Any) -> Iterator[Any]:
            return (yield from execute(goal))

        name = _full(action)
        type_name = of_type or self._type_of(name, 'action')
        server = self._make('actions', {'type': type_name, 'action': name}, behave)
        if not accepts:
            server._accept = _Refusal()  # noqa: SLF001 - as the behaviour `accept` would be

    # Nodes

    def node(self, name: str) -> LiveNode:
        """Return a node by its full name, or by its name if no other has it.

        Raises:
            SimulationError: There is none, or there are several.
        """
        full = name if name.startswith('/') else f'/{name}'
        if full in self._nodes:
            return self._nodes[full]
        found = [each for each in self._nodes if each.rpartition('/')[2] == name]
        if len(found) == 1:
            return self._nodes[found[0]]
        if found:
            message = f"'{name}' may be {' or '.join(found)}"
            raise SimulationError(message, help='give the full name')
        known = [each for each in self._nodes if each != f'/{DRIVER}']
        message = f"there is no node '{name}'"
        raise SimulationError(message, help=suggest(full, known, 'there are'))

    def state(self, node: str) -> SimpleNamespace:
        """Return what the behaviours of a node share."""
        return self.node(node).behaviour_node.state

    def set_parameters(self, node: str, values: Mapping[str, Any], *, atomically: bool) -> None:
        """Set parameters of a node, each by itself or all of them or none.

        Raises:
            ParametersRefusedError: It refused one of them.
        """
        live = self.node(node)
        parameters = [Parameter(name, value=value) for name, value in values.items()]
        if atomically:
            result = live.ros.set_parameters_atomically(parameters)
            if not result.successful:
                message = f"node '{node}' refused all: {result.reason or 'no reason given'}"
                raise ParametersRefusedError(message)
            return
        results = live.ros.set_parameters(parameters)
        refused = [
            f"'{parameter.name}': {result.reason or 'no reason given'}"
            for parameter, result in zip(parameters, results, strict=True)
            if not result.successful
        ]
        if refused:
            message = f"node '{node}' refused {'; '.join(refused)}"
            raise ParametersRefusedError(message)

    def get_parameters(self, node: str) -> dict[str, Any]:
        """Return the values of the parameters of a node."""
        return dict(self.node(node).behaviour_node.parameters)

    def _make(self, section: str, data: dict[str, Any], behaviour: Any = None) -> Any:
        name = data.get('topic') or data.get('service') or data.get('action')
        creation = self._node.behaviour_node._creation  # noqa: SLF001 - as the node's methods do
        creation.create(section, {**data, 'name': name}, str(name), behaviour)
        entity = self._node.entities[section][str(name)]
        self._made[section, str(name)] = entity
        self._node.system.executor.wake()
        return entity

    def _type_of(self, name: str, noun: str) -> str:
        """Return the type of a topic, service or action of the system, by its full name."""
        known = {each: found for (kind, each), found in self._types.items() if kind == noun}
        for node in self._nodes.values():
            known |= _list_types(node, noun)
        if name in known:
            return str(known[name])
        for each, types in self._graph(noun):
            known.setdefault(each, types[0])
        if name in known:
            return str(known[name])
        message = f"nobody in the system has a {noun} '{name}'"
        raise SimulationError(message, help=suggest(name, known, 'there are'))

    def note_types(self, full_name: str) -> None:
        """Know the types of what a node has, also when it has ended."""
        if (node := self._nodes.get(full_name)) is not None:
            for noun in _SECTIONS:
                found = _list_types(node, noun)
                self._types |= {(noun, name): each for name, each in found.items()}

    def _graph(self, noun: str) -> list[tuple[str, list[str]]]:
        ros = self._node.ros
        if noun == 'topic':
            return list(ros.get_topic_names_and_types())
        return list(ros.get_service_names_and_types()) if noun == 'service' else []

    def _qos_for(self, topic: str) -> Any:
        """Return a QoS that suits all who listen."""
        profile = QoSProfile(depth=_DEPTH)
        for end in self._node.ros.get_subscriptions_info_by_topic(topic):
            asked = end.qos_profile
            if asked.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                profile.durability = asked.durability
            if asked.deadline.nanoseconds:
                profile.deadline = asked.deadline
            if asked.liveliness_lease_duration.nanoseconds:
                profile.liveliness = asked.liveliness
                profile.liveliness_lease_duration = asked.liveliness_lease_duration
        return profile


def _full(name: str) -> str:
    return expand_name(name, DRIVER, '/')


def _list_types(node: LiveNode, noun: str) -> dict[str, str]:
    return {
        _resolve(node, spec, noun): str(spec.type)
        for section in _SECTIONS[noun]
        for spec in getattr(node.spec, section).values()
    }


def _resolve(node: LiveNode, spec: Any, noun: str) -> str:
    if noun == 'topic':
        return str(node.ros.resolve_topic_name(spec.topic))
    if noun == 'service':
        return str(node.ros.resolve_service_name(spec.service))
    return str(node.ros.resolve_action_name(spec.action))
