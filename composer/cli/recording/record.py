"""`composer record`: what is published on the ROS graph, in an MCAP file."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import click

from composer.application.running_systems.client import Client
from composer.errors import ExitCode
from composer.recordings.recording_place import new_folder
from composer.signals import asked_to_stop
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_POLL_SEC = 0.1


class Terminal:
    """Tells the user what becomes of a recording."""

    def info(self, message: str) -> None:
        """Print it."""
        click.echo(escape(message), err=True)

    def warning(self, message: str) -> None:
        """Print a warning."""
        self.info(f'warning: {message}')

    def error(self, message: str) -> None:
        """Print an error."""
        self.info(f'error: {message}')


def record(output: Path | None, topics: Sequence[str]) -> int:
    """Record topics until a signal comes; return the exit code.

    It is 1 if the recording ended before, as where the disk is full.

    Args:
        output: What to write; `None` for a new folder with the time in its name.
        topics: Patterns of the topics; all if there are none.

    Raises:
        RosNotFoundError: There is no rclpy.
        UsageError: The file exists, or its folder does not, or a pattern is empty.
        ComposerError: The file cannot be written.
    """
    terminal, target = Terminal(), output or new_folder()
    with asked_to_stop() as is_asked, Client() as client:
        # It imports rclpy, which the client has found.
        from composer.recordings.system_recorder import create_recorder

        recorder = create_recorder(target, topics, terminal)
        try:
            recorder.start(client.node.context)
            terminal.info(f"recording to '{target}'; Ctrl-C ends it")
            while recorder.sink.room and not is_asked():
                time.sleep(_POLL_SEC)
        finally:
            recorder.stop()
        return ExitCode.DONE if recorder.sink.room else ExitCode.FAILED
