"""`composer.Node`: the node that behaviours are called with."""

from __future__ import annotations

import copy
import threading
from collections.abc import Iterator, Mapping
from operator import index
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from composer.entity_kinds import KIND_OF_SECTION
from composer.errors import ComposerError
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from types import SimpleNamespace

    import rclpy.node
    from rclpy.impl.rcutils_logger import RcutilsLogger
    from rclpy.time import Time

    from composer.runtime.nodes.created_entities import (
        CreatedClient,
        CreatedEntity,
        CreatedPublisher,
        CreatedTimer,
        EntityCreation,
    )
    from composer.runtime.nodes.goals import Goal
    from composer.runtime.nodes.remote_parameters import RemoteParameters

# A message, a mapping of (nested) fields, or the bare value of a message with one field.
Payload: TypeAlias = Any


class Publish(Protocol):
    """Publishes payloads on one topic."""

    def __call__(self, payload: Payload) -> None:
        """Convert the payload to the publisher's type, and publish it."""


class UndeclaredError(ComposerError):
    """A behaviour uses something that its node does not declare in the file."""


class UndeclaredParameterError(UndeclaredError, KeyError, AttributeError):
    """A behaviour uses a parameter that its node does not declare in the file.

    It is a `KeyError` and an `AttributeError` for `in`, `get` and `getattr` to work as usual.
    """

    __str__ = Exception.__str__


class Parameters(Mapping[str, Any]):
    """The current values of a node's parameters.

    `parameters.speed` and `parameters['speed']` are the same; names with dots, and names of a
    mapping's own methods (`keys`, `get`, …), need the second form.
    """

    def __init__(self, ros: rclpy.node.Node) -> None:
        self._ros = ros

    def __getitem__(self, name: str) -> Any:
        """Return a parameter's value: a bool, int, float, str or a list of these."""
        if not self._ros.has_parameter(name):
            message = f"node '{self._ros.get_name()}' has no parameter '{name}'"
            raise UndeclaredParameterError(message, help=suggest(name, self, 'it has'))
        value = self._ros.get_parameter_or(name).value
        return value.tolist() if hasattr(value, 'tolist') else value

    def __getattr__(self, name: str) -> Any:
        """Return a parameter's value."""
        if name.startswith('__'):
            raise AttributeError(name)
        return self[name]

    def __call__(self, prefix: str) -> dict[str, Any]:
        """Return the values of the parameters `prefix.…`, by the rest of their names."""
        start = f'{prefix}.'
        return {name.removeprefix(start): self[name] for name in self if name.startswith(start)}

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the declared parameters."""
        return iter(self._ros.list_parameters([], 0).names)

    def __len__(self) -> int:
        """Return how many parameters there are."""
        return len(list(iter(self)))


class Stopping(threading.Event):
    """True once a node has begun to stop; `wait(seconds)` returns then, with true."""

    def __bool__(self) -> bool:
        return self.is_set()


class End:
    """A declared publisher or subscription: on the graph while it is active."""

    def __init__(self, creation: EntityCreation, section: str, name: str) -> None:
        self._creation, self._section, self._name = creation, section, name

    @property
    def active(self) -> bool:
        """Whether it is on the graph."""
        return self._creation.is_active(self._section, self._name)

    @active.setter
    def active(self, is_active: bool) -> None:
        self._creation.activate(self._section, self._name, is_active=is_active)


class Publisher(End):
    """A declared publisher, which may be kept; one that an edit creates again is the same."""

    def __init__(
        self, creation: EntityCreation, name: str, publish: Callable[[str, Payload], None]
    ) -> None:
        super().__init__(creation, 'publishers', name)
        self._publish = publish

    def publish(self, payload: Payload) -> None:
        """Publish; see `Node.publish`."""
        self._publish(self._name, payload)


class Node:
    """A node, as its behaviours see it.

    Attributes:
        name: The node's name, without its namespace.
        parameters: The current values of its parameters.
        state: What the behaviours of the node share; it starts as the file's `state:`. Behaviours
            of one callback group never run at the same time, so it needs no lock.
        own_state: What the behaviour of one timer, subscription, service or action keeps from
            call to call; empty at the start. Two entities with the same behaviour have one each;
            the goals of an action share theirs.
        stopping: True once the node has begun to stop, with the system or alone. For loops in
            behaviours and in threads of their own: `while not node.stopping:`.
        ros: The rclpy node, for everything else.
    """

    __slots__ = (
        '_creation',
        '_entities',
        '_remote_parameters',
        '_shutdown',
        'name',
        'own_state',
        'parameters',
        'ros',
        'state',
        'stopping',
    )

    def __init__(
        self,
        ros: rclpy.node.Node,
        state: SimpleNamespace,
        entities: Mapping[str, Mapping[str, Any]],
        remote_parameters: RemoteParameters,
        shutdown: Callable[[int], None],
        creation: EntityCreation,
    ) -> None:
        self.name: str = ros.get_name()
        self.ros = ros
        self.state = state
        self.own_state: dict[str, Any] = {}
        self.stopping = Stopping()
        self.parameters = Parameters(ros)
        self._entities = entities
        self._creation = creation
        self._remote_parameters = remote_parameters
        self._shutdown = shutdown

    def with_own_state(self) -> Node:
        """Return the same node with an `own_state` of its own; for Composer itself."""
        node = copy.copy(self)
        node.own_state = {}
        return node

    @property
    def logger(self) -> RcutilsLogger:
        """The node's ROS logger."""
        return self.ros.get_logger()

    def now(self) -> Time:
        """Return the time of the node's clock: simulated if `use_sim_time` is set."""
        return self.ros.get_clock().now()

    def sleep(self, seconds: float) -> bool:
        """Wait, and no longer than until the node stops; works in threads of behaviours, too.

        Args:
            seconds: How long: as with `time.sleep`, in virtual time in scenarios.

        Returns:
            Whether all of the time has passed; false once the node stops.
        """
        return not self.stopping.wait(seconds)

    @property
    def publishers(self) -> Mapping[str, Publisher]:
        """Its declared publishers, by their names in the file."""
        creation, publish = self._creation, self.publish
        return {name: Publisher(creation, name, publish) for name in self._entities['publishers']}

    @property
    def subscriptions(self) -> Mapping[str, End]:
        """Its declared subscriptions, by their names in the file."""
        names = self._entities['subscriptions']
        return {name: End(self._creation, 'subscriptions', name) for name in names}

    def publish(self, name: str, payload: Payload) -> None:
        """Publish on one of the node's declared publishers.

        Args:
            name: The publisher's name in the file.
            payload: A message, a mapping of (nested) fields, or the bare value if the message
                has one field.

        Raises:
            UndeclaredError: The node declares no such publisher.
            PayloadError: The payload does not fit the publisher's type.
        """
        self._entity('publishers', name).publish(payload)

    def call(self, name: str, payload: Payload = None, timeout: float | None = 5.0) -> Any:
        """Call a service and return its response; works in any behaviour.

        Args:
            name: The service client's name in the file.
            payload: The request.
            timeout: How long to wait for the server and its response, in seconds; `None` for
                no limit.

        Raises:
            UndeclaredError: The node declares no such service client.
            PayloadError: The payload does not fit the request.
            ServiceNotAvailableError: No server appeared in time.
            CallTimeoutError: The server did not answer in time.
            ServiceFailedError: The server is in this system, and its behaviour raised.
        """
        client = self._entity('service_clients', name)
        return client.call({} if payload is None else payload, timeout)

    async def call_async(
        self,
        name: str,
        payload: Payload = None,
        timeout: float | None = 5.0,  # noqa: ASYNC109 - as in `call`; rclpy's loop has no scopes
    ) -> Any:
        """As `call`, for `async def` behaviours: no thread is held while it waits."""
        client = self._entity('service_clients', name)
        return await client.call_async({} if payload is None else payload, timeout)

    def send_goal(self, name: str, payload: Payload = None, timeout: float | None = 5.0) -> Goal:
        """Send a goal and return it once the server has accepted it.

        Args:
            name: The action client's name in the file.
            payload: The goal.
            timeout: How long to wait for the server and its answer, in seconds; `None` for no
                limit.

        Raises:
            UndeclaredError: The node declares no such action client.
            PayloadError: The payload does not fit the goal.
            ActionNotAvailableError: No server appeared in time.
            GoalTimeoutError: The server did not answer in time.
            GoalRejectedError: The server refused the goal.
        """
        client = self._entity('action_clients', name)
        goal: Goal = client.send_goal({} if payload is None else payload, timeout)
        return goal

    def set_parameters(
        self, node_name: str, values: Mapping[str, Any], timeout: float | None = 5.0
    ) -> None:
        """Set parameters of another node; a relative name lies in this node's namespace.

        Raises:
            ServiceNotAvailableError: The node did not appear within `timeout` seconds.
            CallTimeoutError: It did not answer in time.
            ParametersRefusedError: It refused; the message has its reasons.
        """
        self._remote_parameters.set(node_name, values, timeout)

    def get_parameters(
        self, node_name: str, names: Iterable[str], timeout: float | None = 5.0
    ) -> dict[str, Any]:
        """Return the values of another node's parameters, `None` for one that is not set.

        Raises:
            ServiceNotAvailableError: The node did not appear within `timeout` seconds.
            CallTimeoutError: It did not answer in time.
            ParametersRefusedError: It has no such parameters.
        """
        return self._remote_parameters.get(node_name, names, timeout)

    def create_publisher(
        self, msg_type: Any, topic: str, qos: Any = None, **options: Any
    ) -> CreatedPublisher:
        """Create a publisher, as those that the file declares.

        It belongs to the node, and goes with it; so do all that are created here.

        Args:
            msg_type: The class of its messages, or its name as in `std_msgs/msg/String`.
            qos: A depth, the name of a profile, policies as in the file, or rclpy's profile.
            options: `name`, by which `node.publish` knows it (otherwise that of the topic), and
                the keys that a publisher has in the file.

        Raises:
            EntityError: It cannot be created so.
        """
        data = {'type': msg_type, 'topic': topic, 'qos': qos, **options}
        created: CreatedPublisher = self._creation.create('publishers', data, topic)
        return created

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        behaviour: Callable[..., Any],
        qos: Any = None,
        **options: Any,
    ) -> CreatedEntity:
        """Create a subscription, whose behaviour is called as `behaviour(node, message)`.

        The other arguments are those of `create_publisher`.
        """
        data = {'type': msg_type, 'topic': topic, 'qos': qos, **options}
        created: CreatedEntity = self._creation.create('subscriptions', data, topic, behaviour)
        return created

    def create_timer(
        self, period: float, behaviour: Callable[..., Any], **options: Any
    ) -> CreatedTimer:
        """Create a timer, whose behaviour is called as `behaviour(node)` each `period` seconds.

        Without a `name` it has that of the function.
        """
        data = {'period': period, **options}
        name = str(getattr(behaviour, '__name__', 'timer'))
        created: CreatedTimer = self._creation.create('timers', data, name, behaviour)
        return created

    def create_service(
        self, srv_type: Any, srv_name: str, behaviour: Callable[..., Any], **options: Any
    ) -> CreatedEntity:
        """Create a service, whose behaviour is called as `behaviour(node, request)`."""
        data = {'type': srv_type, 'service': srv_name, **options}
        created: CreatedEntity = self._creation.create('services', data, srv_name, behaviour)
        return created

    def create_client(self, srv_type: Any, srv_name: str, **options: Any) -> CreatedClient:
        """Create a service client; `node.call` knows it by its `name`, or that of the service."""
        data = {'type': srv_type, 'service': srv_name, **options}
        created: CreatedClient = self._creation.create('service_clients', data, srv_name)
        return created

    def destroy(self, entity: CreatedEntity) -> None:
        """Remove what one of the `create_…` methods has returned."""
        self._creation.destroy(entity)

    def shutdown(self, code: int = 0) -> None:
        """Stop the whole system, after this behaviour has returned, with an exit code."""
        self._shutdown(index(code))

    def _entity(self, section: str, name: str) -> Any:
        entities = self._entities[section]
        entity = entities.get(name)
        if entity is None:
            message = f"node '{self.name}' declares no {KIND_OF_SECTION[section].noun} '{name}'"
            raise UndeclaredError(message, help=suggest(name, entities, 'it declares'))
        return entity
