"""The minimal service and client of the ROS 2 tutorials."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer import CallTimeoutError, ServiceNotAvailableError

if TYPE_CHECKING:
    from example_interfaces.srv import AddTwoInts

    from composer import Node


def add(node: Node, request: AddTwoInts.Request) -> int:
    """Return the sum of both numbers."""
    total: int = request.a + request.b
    node.logger.info(f'Incoming request\na: {request.a} b: {request.b}')
    node.logger.info(f'Sending back response: [{total}]')
    return total


def ask(node: Node, a: int, b: int) -> None:
    """Wait for the service, request one sum, and shut the system down."""
    while True:
        try:
            response = node.call('add_two_ints', {'a': a, 'b': b}, timeout=1.0)
            break
        except ServiceNotAvailableError:
            node.logger.info('service not available, waiting again...')
        except CallTimeoutError:
            node.logger.info('no answer, asking again...')
    node.logger.info(f'Result of add_two_ints: for {a} + {b} = {response.sum}')
    node.shutdown()
