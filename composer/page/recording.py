"""Records the ROS graph from when somebody who looks at a page wants it until he has enough."""

from __future__ import annotations

import os
from contextlib import ExitStack
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from composer.errors import ComposerError

if TYPE_CHECKING:
    from composer.application.running_systems.client import Client


class Recording:
    """One recording after the other, each in a new folder of rosbag2 in the current folder.

    Attributes:
        target: What is written now; empty if nothing is.
        told: What was said of it last.
    """

    def __init__(self) -> None:
        self.target = self.told = ''
        self._end = ExitStack()

    def begin(self, client: Client) -> str:
        """Begin, and return what is written.

        Raises:
            ComposerError: One is under way, or the file cannot be written.
        """
        from rclpy.node import Node

        from composer.recordings.graph_recorder import GraphRecorder
        from composer.recordings.recorder import Recorder
        from composer.recordings.recording_place import find_place
        from composer.recordings.topic_patterns import TopicPatterns

        if self.target:
            message = f"'{self.target}' is being recorded already"
            raise ComposerError(message)
        target = Path.cwd() / f'rosbag2_{datetime.now():%Y_%m_%d-%H_%M_%S}'  # noqa: DTZ005 - as rosbag2
        patterns = TopicPatterns(())
        recorder = Recorder(find_place(target), self)
        node = Node(
            f'_composer_record_{os.getpid()}',
            context=client.node.context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        graph = GraphRecorder(node, recorder, patterns, self.warning)
        with ExitStack() as end:
            end.callback(lambda: recorder.finish(patterns.describe_unused(graph.topics)))
            end.callback(node.destroy_node)
            end.callback(graph.stop)
            graph.start()
            self._end = end.pop_all()
        self.target = str(target)
        return f"recording to '{target}'"

    def end(self) -> str:
        """End it, and return what became of it.

        Raises:
            ComposerError: Nothing is recorded.
        """
        if not self.target:
            message = 'nothing is recorded'
            raise ComposerError(message)
        self._end.close()
        self.target = ''
        return self.told

    def info(self, message: str) -> None:
        """Note what is said."""
        self.told = message

    warning = error = info
