"""One node says a name, the other greets it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from std_msgs.msg import String

    from composer import Node


def say_name(node: Node) -> str:
    """Return the node's parameter `name`."""
    return str(node.parameters.name)


def reply(node: Node, message: String) -> None:
    """Greet whoever was named."""
    node.logger.info(f'Hello {message.data}! This is the greeter bot.')
