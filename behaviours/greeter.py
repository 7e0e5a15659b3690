"""One node publishes a name, the other greets it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from std_msgs.msg import String

    from composer import Node


def say_name(node: Node) -> str:
    """Return the parameter `name` of the node."""
    return str(node.parameters.name)


def reply(node: Node, message: String) -> None:
    """Greet the name that was received."""
    node.logger.info(f'Hello {message.data}! This is the greeter bot.')
