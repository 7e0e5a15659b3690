"""A service that adds or subtracts, as a parameter says, and its client."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from example_interfaces.srv import AddTwoInts

    from composer import Node


def calculate(node: Node, request: AddTwoInts.Request) -> int:
    """Add or subtract, depending on the parameter `operation`."""
    subtracts = node.parameters.operation == 'subtract'
    result: int = request.a - request.b if subtracts else request.a + request.b
    sign = '-' if subtracts else '+'
    node.logger.info(f'{request.a} {sign} {request.b} = {result}')
    return result


def ask(node: Node, a: int, b: int, operation: str) -> None:
    """Set the operation if one is given, request one result, and shut the system down."""
    if operation:
        node.set_parameters('calculator_server', {'operation': operation})
    response = node.call('calculate', {'a': a, 'b': b})
    node.logger.info(f'Result: {response.sum}')
    node.shutdown()
