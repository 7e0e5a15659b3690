"""Read recordings: MCAP files, and the folders of rosbag2 that hold some.

Messages are read as they are asked for: what is held of a file is its index and a few chunks.
Nothing here needs ROS until messages are decoded.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from composer.input_limits import MAX_SCANNED_BYTES, UnreadableFileError, read_file
from composer.recordings import metadata
from composer.recordings.recorded_topics import (
    RawMessage,
    RecordedTopic,
    RecordingError,
    joined,
    require_mcap,
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

_SUFFIX: Final = '.mcap'
# In bytes: PyYAML takes seconds for one.
_LARGEST_METADATA: Final = 1_000_000


@record
class Recording:
    """What a recording has.

    Attributes:
        path: The file or folder as it was named.
        files: Its files, in the order of their messages.
        topics: Sorted by name.
        start_ns: The time of its first message; 0 if there is none.
        end_ns: That of the last one.
        problem: Why it ends too early, as it does if its recorder was killed or its disk was
            full; empty if it does not.
    """

    path: Path
    files: Sequence[Path]
    topics: Sequence[RecordedTopic]
    start_ns: int
    end_ns: int
    problem: str = ''

    def raw_messages(
        self, topics: Collection[str] | None = None, *, since_ns: int | None = None
    ) -> Iterator[RawMessage]:
        """Yield messages in the order of their times, without those of topics with a problem.

        Args:
            topics: The names of those that are wanted; `None` for all.
            since_ns: Earlier ones are left out.

        Raises:
            RecordingError: The file is damaged, or cannot be read any more. One that only ends
                too early does not raise.
        """
        from composer.recordings.mcap_reader import read_messages

        known = {(each.name, each.type): each for each in self.topics if not each.problem}
        for path in self.files:
            yield from read_messages(path, known, topics, since_ns or 0)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[tuple[int, str, Any]]:
        """Yield time (ns), topic and message, decoded; see `raw_messages`.

        Topics whose types are not here are left out: `composer.recordings.types` names them.

        Raises:
            RecordingError: See `raw_messages`; or a message is not of its type.
        """
        from composer.recordings.types import MessageTypes

        types = MessageTypes(self.topics)
        for message in self.raw_messages(topics):
            decode = types.decoder(message.topic)
            if decode is not None:
                yield message.time_ns, message.topic.name, decode(message.data)


def read_recording(path: str | Path, *, is_bounded: bool = False) -> Recording:
    """Read what a recording has, but not its messages.

    Args:
        path: An MCAP file, or a folder that rosbag2 has made of such files.
        is_bounded: Whether it is an error if that takes longer than seconds.

    Raises:
        RecordingError: There is none, or it is of another kind, or damaged; or the library for
            recordings is not installed.
    """
    require_mcap()
    from composer.recordings.mcap_reader import Budget, read_content

    path = Path(path)
    files = _list_files(path)
    budget = Budget(MAX_SCANNED_BYTES if is_bounded else None)
    parts = [read_content(each, budget) for each in files]
    topics: dict[tuple[str, str], RecordedTopic] = {}
    for part in parts:
        for topic in part.topics:
            key = topic.name, topic.type
            topics[key] = joined(topics[key], topic) if key in topics else topic
    filled = [part for part in parts if part.end_ns]
    return Recording(
        path,
        files,
        [topics[key] for key in sorted(topics)],
        min((part.start_ns for part in filled), default=0),
        max((part.end_ns for part in filled), default=0),
        next((part.problem for part in parts if part.problem), ''),
    )


def _list_files(path: Path) -> list[Path]:
    if not os.path.isdir(path):
        if not os.path.lexists(path):
            message = f"there is no recording '{path}'"
            raise RecordingError(message, help='name an MCAP file, or a folder of rosbag2')
        return [path]
    named = _named_files(path)
    files = [path / each for each in named] if named else sorted(path.glob(f'*{_SUFFIX}'))
    others = [each for each in files if each.suffix != _SUFFIX]
    if others:
        message = f"'{others[0]}' is no MCAP file, and no other kind can be read"
        advice = f"'ros2 bag convert' makes MCAP of it; or 'rosbags-convert --src {path}'"
        raise RecordingError(message, help=advice)
    if not files:
        message = f"there are no MCAP files in the folder '{path}'"
        raise RecordingError(message, help='name an MCAP file, or a folder of rosbag2')
    return files


def _named_files(folder: Path) -> list[str]:
    """Return the files that the `metadata.yaml` of a folder names; none if it has none."""
    path = folder / metadata.FILE_NAME
    if not os.path.lexists(path):
        return []
    try:
        text = read_file(path, _LARGEST_METADATA).decode()
        named = metadata.parse_text(text)[metadata.ROOT]['relative_file_paths']
        return [*dict.fromkeys(map(str, named))]
    except UnreadableFileError as error:
        message = f"'{path}': {error}"
        raise RecordingError(message, help='name the MCAP file itself') from error
    except (LookupError, TypeError, ValueError) as error:
        message = f"'{path}' cannot be read: {error}"
        raise RecordingError(message, help='name the MCAP file itself') from error
