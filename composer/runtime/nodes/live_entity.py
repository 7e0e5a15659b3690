"""What a running node knows of its entities, whatever their kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from composer.language.specs import NodeSpec, OnError, ParameterSpec


class Suspended(Protocol):
    """A behaviour that has begun, and is suspended until its next turn."""

    def close(self, timeout_sec: float, *, for_good: bool = True) -> None:
        """End it; what it raises is reported.

        Args:
            for_good: Whether it never begins anew.
        """


class LiveEntity(Protocol):
    """An entity of a node that runs."""

    def change(self, spec: Any) -> None:
        """Do as `spec` says from the next call on; what ROS fixes is the same as before."""

    def destroy(self) -> None:
        """Remove it from the node and the graph; its behaviours are not called any more."""


class NodeParameters(Protocol):
    """The declared parameters of a node that runs.

    Attributes:
        specs: What they are declared as.
        set_live: The names of those that somebody has set since they were declared.
    """

    specs: dict[str, ParameterSpec]
    set_live: set[str]

    def declare(self, spec: ParameterSpec) -> None:
        """Declare a parameter."""

    def undeclare(self, name: str) -> None:
        """Remove a parameter."""

    def set(self, spec: ParameterSpec, value: Any) -> None:
        """Set a parameter to a value of the files."""

    def ask(self, spec: NodeSpec) -> None:
        """Call the behaviours of this node about changes from now on."""


class NodeLifecycle(Protocol):
    """The lifecycle of a node that runs.

    Attributes:
        start: The state to which it brings itself when it starts.
    """

    start: str

    @property
    def state(self) -> str:
        """The state that it is in, as in `active`."""

    def begin(self) -> None:
        """Let others change its state, as the node has started."""

    def require(self, goal: str) -> None:
        """Bring an unconfigured node to a state, or raise."""

    def leave(self, timeout_sec: float) -> None:
        """Bring it down, before the node goes."""

    def follow(self) -> None:
        """Do what the node says now that was edited."""


class BehaviourOptions(Protocol):
    """What the file says about the behaviours of an entity, or of a node."""

    @property
    def on_error(self) -> OnError:
        """What is done when one raises."""

    @property
    def warn_after_sec(self) -> float | None:
        """How long one may run before that is reported."""
