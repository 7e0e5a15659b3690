"""A client that uses the response of a service as the goal of an action."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Generator

    from composer import Node


def ask(node: Node) -> Generator[None, None, None]:
    """Request 2 + 3, compute that many steps of the Fibonacci sequence, and shut down."""
    total = node.call('add_two_ints', {'a': 2, 'b': 3}).sum
    node.logger.info(f'2 + 3 = {total}')
    yield
    goal = node.send_goal('fibonacci', {'order': total})
    for feedback in goal.feedback:
        node.logger.info(f'feedback: {list(feedback.sequence)}')
    node.logger.info(f'{goal.status}: {list(goal.result().sequence)}')
    node.shutdown()
