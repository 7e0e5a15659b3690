"""What recordings consist of: topics, and messages as they were recorded."""

from __future__ import annotations

import re
from functools import cached_property
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from composer.errors import ComposerError
from composer.recordings import metadata
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

# Of a package, and of a type in it: they become names of files.
_NAME: Final = r'[A-Za-z]\w{0,199}'
_TYPE_NAME: Final = re.compile(rf'({_NAME})(?:/(msg|srv|action))?/({_NAME})', re.ASCII)


class RecordingError(ComposerError):
    """A recording cannot be read, or not on."""


def require_mcap() -> None:
    """Do nothing if the library for recordings is installed.

    Raises:
        RecordingError: It is not.
    """
    if find_spec('mcap') is None:
        message = 'recordings need the package mcap, which is not installed'
        raise RecordingError(message, help="pip install 'rclpy-composer[record]'")


class RawMessage(NamedTuple):
    """A message as it was recorded.

    Attributes:
        time_ns: When, in ns since 1970, or by the clock of the system that was recorded.
        topic: What it was published on, with its type.
        data: The message in CDR.
    """

    time_ns: int
    topic: RecordedTopic
    data: bytes


@record
class RecordedTopic:
    """A topic of a recording. One that had two types at different times is there twice.

    Attributes:
        name: Its full name.
        type: The full name of its type, as in `std_msgs/msg/String`.
        count: How many messages of it there are; `None` if the file does not say.
        offers: The QoS of its publishers as rosbag2 writes it; empty if it was not recorded.
        definition: The definitions of the type and of all that it uses; empty if unknown.
        type_hash: The hash of the type as `RIHS01_…`; empty if it was not recorded.
        problem: Why its messages cannot be used; empty if they can.
    """

    name: str
    type: str
    count: int | None = None
    offers: str = ''
    definition: str = ''
    type_hash: str = ''
    problem: str = ''

    @cached_property
    def qos(self) -> Sequence[Mapping[str, Any]]:
        """The QoS of each publisher: policies by name, in small letters, and durations in ns."""
        return metadata.read_qos(self.offers)


def full_type_name(name: str) -> str:
    """Return the full name of a type, which writers other than rosbag2 shorten; else nothing."""
    match = _TYPE_NAME.fullmatch(name)
    return f'{match[1]}/{match[2] or "msg"}/{match[3]}' if match else ''


def joined(first: RecordedTopic, second: RecordedTopic) -> RecordedTopic:
    """Return the topic of which two files, or two channels of a file, have messages."""
    count = None
    if first.count is not None and second.count is not None:
        count = first.count + second.count
    return RecordedTopic(
        first.name,
        first.type,
        count,
        first.offers or second.offers,
        first.definition or second.definition,
        first.type_hash or second.type_hash,
        first.problem or second.problem,
    )
