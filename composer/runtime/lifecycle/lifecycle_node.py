"""The rclpy node of a node with a lifecycle: the state machine and its services are rclpy's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.lifecycle.node import LifecycleNodeMixin

from composer.runtime.nodes.ros_node import ComposedRosNode

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.lifecycle import TransitionCallbackReturn


class LifecycleRosNode(LifecycleNodeMixin, ComposedRosNode):
    """A node with the five services of a lifecycle, and the topic of its transitions.

    Attributes:
        change_state: Makes the transition of an identifier of `lifecycle_msgs/msg/Transition`.
    """

    change_state: Callable[[int], TransitionCallbackReturn]

    def __init__(self, *arguments: Any) -> None:
        ComposedRosNode.__init__(self, *arguments)
        # Whoever asks is answered, whatever the behaviours of the node do.
        LifecycleNodeMixin.__init__(self, callback_group=ReentrantCallbackGroup())

    @property
    def state_machine(self) -> Any:
        """The state machine of rcl."""
        return self._state_machine

    def _LifecycleNodeMixin__change_state(self, transition: int) -> TransitionCallbackReturn:  # noqa: N802 - rclpy's name for it
        """See the base class: its services and `trigger_…` make all transitions by this."""
        return self.change_state(transition)

    def destroy_node(self) -> Any:
        """See the base class, which leaves the state machine, and with it the node."""
        result = super().destroy_node()
        self._state_machine.destroy_when_not_in_use()
        return result
