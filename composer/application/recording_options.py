"""What `composer up` is to record, and to show Foxglove or on a page."""

from __future__ import annotations

import subprocess
import sys
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from composer.errors import ComposerError, UsageError
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from rclpy.context import Context

    from composer.foxglove import BridgeOptions
    from composer.foxglove.bridge import FoxgloveBridge
    from composer.runtime.local_part import SystemRecorder
    from composer.runtime.messages.local_delivery import LocalTopics

_PAGE_SEC = 5.0


@record
class RecordingOptions:
    """The options of a command line.

    Attributes:
        target: What is to be written; `None` if nothing is recorded.
        topics: Patterns of the topics that are wanted; all if there are none.
        bridge: How it is shown to Foxglove; `None` if it is not.
        page_port: Where its page is served, 0 for any port; `None` for no page.
        allows_changes: Whether the page may change it.

    Raises:
        UsageError: Topics are named, and no file.
    """

    target: Path | None = None
    topics: Sequence[str] = ()
    bridge: BridgeOptions | None = None
    page_port: int | None = None
    allows_changes: bool = False

    def __post_init__(self) -> None:
        """Check that they fit together."""
        if self.topics and self.target is None:
            message = '--topics is for --record'
            raise UsageError(message, help='name the file, as in --record run.mcap')

    @contextmanager
    def recorder(self, name: str) -> Iterator[Recorders]:
        """Yield what records and shows a system. The file is complete at the end.

        Args:
            name: Of the system.

        Raises:
            UsageError: The file exists, or its folder does not, or a pattern is empty.
            ComposerError: The file cannot be written, or the port cannot be served.
        """
        recorders = Recorders()
        page = self._start_page(name)
        try:
            if self.target is not None:
                # These import rclpy.
                from composer.recordings.system_recorder import create_recorder
                from composer.runtime.logs import system_logger

                recorders.append(create_recorder(self.target, self.topics, system_logger))
            if self.bridge is not None:
                recorders.append(create_bridge(self.bridge, name))
            yield recorders
        finally:
            recorders.stop()
            if page is not None:
                end_by_input(page)

    def _start_page(self, name: str) -> subprocess.Popen[bytes] | None:
        if self.page_port is None:
            return None
        options = ['--no-browser', '--ends-with-input', f'--port={self.page_port}']
        options += ['--allow-changes'] * self.allows_changes
        # It ends with this process, whatever happens to that; signals of a terminal are not its.
        return subprocess.Popen(  # noqa: S603 - Composer itself
            [sys.executable, '-m', 'composer', 'page', *options, '--', name],
            stdin=subprocess.PIPE,
            start_new_session=True,
        )


def end_by_input(page: subprocess.Popen[bytes]) -> None:
    """End a process that ends with its input."""
    try:
        page.communicate(timeout=_PAGE_SEC)
    except subprocess.TimeoutExpired:
        page.kill()
        page.wait()


class Recorders(list['SystemRecorder']):
    """All that gets the messages of a system; as one."""

    def start(self, context: Context, topics: LocalTopics) -> None:
        """See `SystemRecorder`."""
        for recorder in self:
            recorder.start(context, topics)

    def stop(self) -> None:
        """See `SystemRecorder`."""
        for recorder in self:
            recorder.stop()


def create_bridge(options: BridgeOptions, name: str) -> FoxgloveBridge:
    """Return what shows a system, or the ROS graph, to Foxglove.

    Raises:
        ComposerError: The library is not installed, or the port cannot be served.
    """
    if find_spec('foxglove') is None:
        message = 'Foxglove needs the package foxglove-sdk, which is not installed'
        raise ComposerError(message, help="pip install 'rclpy-composer[foxglove]'")
    from composer.foxglove.bridge import FoxgloveBridge
    from composer.runtime.logs import system_logger

    return FoxgloveBridge(options, name, system_logger)
