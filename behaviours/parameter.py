"""A parameter that can be changed while the node runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer import Node


def greet(node: Node) -> None:
    """Greet the current value of the parameter."""
    node.logger.info(f'Hello {node.parameters.my_parameter}!')
