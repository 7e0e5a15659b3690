"""What `composer up` is to record, and to show Foxglove."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from composer.errors import UsageError
from composer.foxglove import require_foxglove
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from rclpy.context import Context

    from composer.foxglove import BridgeOptions
    from composer.foxglove.bridge import FoxgloveBridge
    from composer.runtime.local_part import SystemRecorder
    from composer.runtime.messages.local_delivery import LocalTopics


@record
class RecordingOptions:
    """The options of a command line.

    Attributes:
        target: What is to be written; `None` if nothing is recorded.
        topics: Patterns of the topics that are wanted; all if there are none.
        bridge: How it is shown; `None` if it is not.

    Raises:
        UsageError: Topics are named, and no file.
    """

    target: Path | None = None
    topics: Sequence[str] = ()
    bridge: BridgeOptions | None = None

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
        try:
            if self.target is not None:
                recorders.append(_create_recorder(self.target, self.topics))
            if self.bridge is not None:
                recorders.append(create_bridge(self.bridge, name))
            yield recorders
        finally:
            recorders.stop()


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


def _create_recorder(target: Path, topics: Sequence[str]) -> SystemRecorder:
    # These import rclpy.
    from composer.recordings.recorder import Recorder
    from composer.recordings.recording_place import find_place
    from composer.recordings.system_recorder import SystemRecorder
    from composer.recordings.topic_patterns import TopicPatterns
    from composer.runtime.logs import system_logger

    patterns = TopicPatterns(topics)
    recorder = Recorder(find_place(target), system_logger)
    return SystemRecorder(recorder, patterns, system_logger.warning)


def create_bridge(options: BridgeOptions, name: str) -> FoxgloveBridge:
    """Return what shows a system, or the ROS graph, to Foxglove.

    Raises:
        ComposerError: The library is not installed, or the port cannot be served.
    """
    require_foxglove()
    from composer.foxglove.bridge import FoxgloveBridge
    from composer.runtime.logs import system_logger

    return FoxgloveBridge(options, name, system_logger)
