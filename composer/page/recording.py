"""Records the ROS graph from when somebody who looks at a page wants it until he has enough."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from composer.errors import ComposerError

if TYPE_CHECKING:
    from composer.application.running_systems.client import Client
    from composer.recordings.system_recorder import SystemRecorder


class Recording:
    """One recording after the other, each in a new folder of rosbag2 in the current folder.

    Attributes:
        target: What is written now; empty if nothing is.
        told: What was said of it last.
    """

    def __init__(self) -> None:
        self.target = self.told = ''
        self._recorder: SystemRecorder | None = None

    def begin(self, client: Client) -> str:
        """Begin, and return what is written.

        Raises:
            ComposerError: One is under way, or the file cannot be written.
        """
        from composer.recordings.recording_place import new_folder
        from composer.recordings.system_recorder import create_recorder

        if self.target:
            message = f"'{self.target}' is being recorded already"
            raise ComposerError(message)
        target = Path.cwd() / new_folder()
        recorder = create_recorder(target, (), self)
        try:
            recorder.start(client.node.context)
        except Exception:
            recorder.stop()
            raise
        self._recorder, self.target = recorder, str(target)
        return f"recording to '{target}'"

    def end(self) -> str:
        """End it, and return what became of it.

        Raises:
            ComposerError: Nothing is recorded.
        """
        if self._recorder is None:
            message = 'nothing is recorded'
            raise ComposerError(message)
        self._recorder.stop()
        self._recorder, self.target = None, ''
        return self.told

    def info(self, message: str) -> None:
        """Note what is said."""
        self.told = message

    warning = error = info
