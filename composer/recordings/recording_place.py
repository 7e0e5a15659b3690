"""Where a recording is written: a file, or a folder as `ros2 bag record` makes it."""

from __future__ import annotations

import os
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final

from composer.errors import ComposerError, UsageError
from composer.recordings import metadata
from composer.records import record

if TYPE_CHECKING:
    from io import FileIO

SUFFIX: Final = '.mcap'


@record
class RecordingPlace:
    """The files of a recording that is to be written.

    Attributes:
        target: As the user named it: a file whose name ends in `.mcap`, or a folder.
        file: The MCAP file.
    """

    target: Path
    file: Path

    @property
    def is_folder(self) -> bool:
        """Whether the target is a folder."""
        return self.target != self.file

    def create(self) -> FileIO:
        """Create the file, and its folder if that is the target; return it, open for writing.

        Raises:
            UsageError: The target exists, or its folder does not.
            ComposerError: It cannot be written.
        """
        if os.path.lexists(self.target):
            message = f"'{self.target}' exists, and is not overwritten"
            raise UsageError(message, help='name another file for the recording')
        try:
            if self.is_folder:
                self.target.mkdir()
            return self.file.open('xb', buffering=0)
        except FileNotFoundError as error:
            message = f"there is no folder '{self.target.parent}' for the recording"
            raise UsageError(message, help=f'mkdir -p {self.target.parent}') from error
        except OSError as error:
            message = f"'{self.target}' cannot be written: {error.strerror or error}"
            raise ComposerError(message) from error

    def write_metadata(self, text: str) -> None:
        """Write what rosbag2 wants to find beside the file, unless the folder has one already.

        Then that is of another recording, or of something else. Readers can do without: all of it
        is in the file, too.
        """
        path = self.file.with_name(metadata.FILE_NAME)
        with suppress(OSError), path.open('x', encoding='utf-8') as stream:
            stream.write(text)


def find_place(target: Path) -> RecordingPlace:
    """Return where a recording is written that the user names so."""
    if target.suffix == SUFFIX:
        return RecordingPlace(target, target)
    return RecordingPlace(target, target / f'{target.name}_0{SUFFIX}')


def new_folder() -> Path:
    """Return a folder for a recording that has no name, as rosbag2 calls it."""
    return Path(f'rosbag2_{datetime.now():%Y_%m_%d-%H_%M_%S}')  # noqa: DTZ005 - as rosbag2
