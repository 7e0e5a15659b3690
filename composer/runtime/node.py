"""`composer.Node`: what a behaviour sees of its node."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from composer.errors import ComposerError
from composer.names import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import SimpleNamespace

    import rclpy.node
    from rclpy.impl.rcutils_logger import RcutilsLogger
    from rclpy.time import Time

# A message, a mapping of (nested) fields, or the bare value of a message with one field.
Payload: TypeAlias = Any


class Publish(Protocol):
    """Publishes payloads on one topic."""

    def __call__(self, payload: Payload) -> None:
        """Convert the payload to the publisher's type, and publish it."""


class UndeclaredError(ComposerError):
    """A behaviour asks for something that its node does not declare in the file."""


class UndeclaredParameterError(UndeclaredError, KeyError, AttributeError):
    """A behaviour asks for a parameter that its node does not declare in the file.

    As a `KeyError` and an `AttributeError` it lets `in`, `get` and `getattr` do what they promise.
    """

    __str__ = Exception.__str__


class Parameters(Mapping[str, Any]):
    """The values of a node's parameters, as they are now.

    `parameters.speed` and `parameters['speed']` are the same; names with dots, and those that a
    mapping has itself (`keys`, `get`, …), need the second form.
    """

    def __init__(self, ros: rclpy.node.Node) -> None:
        self._ros = ros

    def __getitem__(self, name: str) -> Any:
        """Return a parameter's value: a bool, int, float, str or a list of these."""
        if not self._ros.has_parameter(name):
            message = f"node '{self._ros.get_name()}' has no parameter '{name}'"
            raise UndeclaredParameterError(message, help=did_you_mean(name, self, 'it has'))
        value = self._ros.get_parameter_or(name).value
        return value.tolist() if hasattr(value, 'tolist') else value

    def __getattr__(self, name: str) -> Any:
        """Return a parameter's value."""
        if name.startswith('__'):
            raise AttributeError(name)
        return self[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the declared parameters."""
        return iter(self._ros.list_parameters([], 0).names)

    def __len__(self) -> int:
        """Return how many parameters there are."""
        return len(list(iter(self)))


class Node:
    """A node, as its behaviours see it.

    Attributes:
        name: The node's name, without its namespace.
        parameters: The values of its parameters, always those of now.
        state: What the behaviours of the node share; starts as the file's `state:`. Behaviours of
            one callback group never run at the same time, so it needs no lock.
        ros: The rclpy node beneath, for what is not here.
    """

    __slots__ = ('_publishers', '_shutdown', 'name', 'parameters', 'ros', 'state')

    def __init__(
        self,
        ros: rclpy.node.Node,
        state: SimpleNamespace,
        publishers: Mapping[str, Publish],
        shutdown: Callable[[int], None],
    ) -> None:
        self.name: str = ros.get_name()
        self.ros = ros
        self.state = state
        self.parameters = Parameters(ros)
        self._publishers = publishers
        self._shutdown = shutdown

    @property
    def logger(self) -> RcutilsLogger:
        """The node's ROS logger."""
        return self.ros.get_logger()

    def now(self) -> Time:
        """Return the time of the node's clock: simulated if `use_sim_time` is set."""
        return self.ros.get_clock().now()

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
        publish = self._publishers.get(name)
        if publish is None:
            message = f"node '{self.name}' declares no publisher '{name}'"
            raise UndeclaredError(
                message, help=did_you_mean(name, self._publishers, 'it declares')
            )
        publish(payload)

    def shutdown(self, code: int = 0) -> None:
        """End the whole system with this exit code; it stops after this behaviour has returned."""
        self._shutdown(code)
