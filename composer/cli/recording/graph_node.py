"""The node of a command on the ROS graph, and what it says on the terminal."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from composer.errors import UsageError
from composer.processes.kernel import CLIENT_THREADS, check_threads
from composer.runtime.environment import check_middleware, check_ros, check_shell
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rclpy.node import Node


class Terminal:
    """Tells the user what becomes of a recording."""

    def info(self, message: str) -> None:
        """Print it."""
        click.echo(escape(message), err=True)

    def warning(self, message: str) -> None:
        """Print a warning."""
        click.echo(escape(f'warning: {message}'), err=True)

    def error(self, message: str) -> None:
        """Print an error."""
        click.echo(escape(f'error: {message}'), err=True)


@contextmanager
def graph_node(name: str, ros_arguments: Sequence[str] = ()) -> Iterator[Node]:
    """Yield a node without services and topics of its own.

    Raises:
        RosNotFoundError: There is no rclpy.
        StartError: ROS cannot start.
        UsageError: The ROS arguments are wrong.
    """
    check_ros()
    check_threads(CLIENT_THREADS)
    check_shell({})
    check_middleware(os.environ)
    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.parameter import Parameter

    context = Context()
    try:
        # No log file: it logs nothing.
        context.init(['--ros-args', *ros_arguments], initialize_logging=False)
    except Exception as error:
        message = f'ROS 2 cannot start: {error}'
        raise UsageError(message) from error
    try:
        node = Node(
            f'{name}_{os.getpid()}',
            context=context,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter('start_type_description_service', value=False)],
        )
        try:
            yield node
        finally:
            node.destroy_node()
    finally:
        context.try_shutdown()
