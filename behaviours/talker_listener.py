"""The minimal publisher and subscriber of the ROS 2 tutorials."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from std_msgs.msg import String

    from composer import Node


def talk(node: Node) -> str:
    """Return the next greeting, numbered from 0."""
    text = f'Hello World: {node.state.count}'
    node.state.count += 1
    node.logger.info(f'Publishing: "{text}"')
    return text


def listen(node: Node, message: String) -> None:
    """Log the message."""
    node.logger.info(f'I heard: "{message.data}"')
