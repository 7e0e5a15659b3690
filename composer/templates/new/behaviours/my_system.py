"""What the nodes of my_system do."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from std_msgs.msg import String

    from composer import Node


def greet(node: Node) -> str:
    """Return the greeting to publish."""
    return f'Hello {node.parameters.who}!'


def hear(node: Node, message: String) -> None:
    """Log the greeting."""
    node.logger.info(f'I heard: {message.data}')
