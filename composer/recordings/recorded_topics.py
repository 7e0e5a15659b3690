"""What recordings consist of: topics, and messages as they were recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from composer.errors import ComposerError
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


class RecordingError(ComposerError):
    """A recording cannot be read, or not on."""


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
        qos: That of each of its publishers: the policies by name, in small letters, and durations
            in ns. Empty if it was not recorded.
        definition: The definitions of the type and of all that it uses; empty if unknown.
        type_hash: The hash of the type as `RIHS01_…`; empty if it was not recorded.
        problem: Why its messages cannot be used; empty if they can.
    """

    name: str
    type: str
    count: int | None = None
    qos: Sequence[Mapping[str, Any]] = ()
    definition: str = ''
    type_hash: str = ''
    problem: str = ''


def joined(first: RecordedTopic, second: RecordedTopic) -> RecordedTopic:
    """Return the topic of which two files, or two channels of a file, have messages."""
    count = None
    if first.count is not None and second.count is not None:
        count = first.count + second.count
    return RecordedTopic(
        first.name,
        first.type,
        count,
        first.qos or second.qos,
        first.definition or second.definition,
        first.type_hash or second.type_hash,
        first.problem or second.problem,
    )
