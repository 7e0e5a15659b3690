"""What `composer up` is to record."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from composer.errors import UsageError
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from composer.recordings.system_recorder import SystemRecorder


@record
class RecordingOptions:
    """The options of a command line.

    Attributes:
        target: What is to be written; `None` if nothing is recorded.
        topics: Patterns of the topics that are wanted; all if there are none.

    Raises:
        UsageError: Topics are named, and no file.
    """

    target: Path | None = None
    topics: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Check that they fit together."""
        if self.topics and self.target is None:
            message = '--topics is for --record'
            raise UsageError(message, help='name the file, as in --record run.mcap')

    @contextmanager
    def recorder(self) -> Iterator[SystemRecorder | None]:
        """Yield what records a system; `None` if nothing does. The file is complete at the end.

        Raises:
            UsageError: The file exists, or its folder does not, or a pattern is empty.
            ComposerError: The file cannot be written.
        """
        if self.target is None:
            yield None
            return
        # These import rclpy.
        from composer.recordings.recorder import Recorder
        from composer.recordings.recording_place import find_place
        from composer.recordings.system_recorder import SystemRecorder
        from composer.recordings.topic_patterns import TopicPatterns
        from composer.runtime.logs import system_logger

        patterns = TopicPatterns(self.topics)
        recorder = Recorder(find_place(self.target), system_logger)
        system_recorder = SystemRecorder(recorder, patterns, system_logger.warning)
        try:
            yield system_recorder
        finally:
            system_recorder.stop()
