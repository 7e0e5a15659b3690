"""The functions that the system calls."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from my_system_interfaces.msg import Greeting

    from composer import Node


def greet(node: Node) -> dict[str, object]:
    """Return the greeting to publish."""
    node.state.count += 1
    return {'text': f'Hello {node.parameters.who}!', 'count': node.state.count}


def hear(node: Node, message: Greeting) -> None:
    """Log the greeting."""
    node.logger.info(f'I heard greeting {message.count}: {message.text}')
