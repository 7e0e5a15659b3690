"""The action server and client of the ROS 2 tutorials."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated

from composer import GoalRejectedError

if TYPE_CHECKING:
    from collections.abc import Generator

    from action_tutorials_interfaces.action import Fibonacci

    from composer import Node


def compute(
    node: Node, goal: Fibonacci.Goal, period: Annotated[float, '>= 0'] = 1.0
) -> Generator[list[int], None, list[int]]:
    """Compute the sequence, with each step as feedback.

    Args:
        period: Seconds between two steps.
    """
    node.logger.info('Executing goal...')
    sequence = [0, 1]
    for _ in range(1, goal.order):
        sequence.append(sequence[-1] + sequence[-2])
        node.logger.info(f'Feedback: {sequence}')
        yield sequence
        time.sleep(period)
    return sequence


def send(node: Node, order: int) -> None:
    """Send one goal, and log whether it was accepted."""
    try:
        node.send_goal('fibonacci', {'order': order}, timeout=None)
    except GoalRejectedError:
        node.logger.info('Goal rejected :(')
        node.shutdown(1)
    else:
        node.logger.info('Goal accepted :)')


def show_feedback(node: Node, feedback: Fibonacci.Feedback) -> None:
    """Log the sequence so far."""
    node.logger.info(f'Received feedback: {list(feedback.partial_sequence)}')


def show_result(node: Node, result: Fibonacci.Result) -> None:
    """Log the sequence, and shut the system down."""
    node.logger.info(f'Result: {list(result.sequence)}')
    node.shutdown()
