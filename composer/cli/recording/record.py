"""`composer record`: what is published on the ROS graph, in an MCAP file."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from composer.cli.recording.graph_node import Terminal, graph_node
from composer.errors import ExitCode
from composer.signals import asked_to_stop

if TYPE_CHECKING:
    from collections.abc import Sequence

_POLL_SEC = 0.1


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
    target = output or Path(f'rosbag2_{datetime.now():%Y_%m_%d-%H_%M_%S}')  # noqa: DTZ005 - as rosbag2
    with asked_to_stop() as is_asked, graph_node('_composer_record') as node:
        # These import rclpy, which the node has found.
        from composer.recordings.graph_recorder import GraphRecorder
        from composer.recordings.recorder import Recorder
        from composer.recordings.recording_place import find_place
        from composer.recordings.topic_patterns import TopicPatterns

        terminal, patterns = Terminal(), TopicPatterns(topics)
        recorder = Recorder(find_place(target), terminal)
        graph = GraphRecorder(node, recorder, patterns, terminal.warning)
        graph.start()
        terminal.info(f"recording to '{target}'; Ctrl-C ends it")
        while recorder.room and not is_asked():
            time.sleep(_POLL_SEC)
        graph.stop()
        recorder.finish(patterns.describe_unused(graph.topics))
        return ExitCode.DONE if recorder.room else ExitCode.FAILED
