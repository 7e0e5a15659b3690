"""Read one MCAP file with the library `mcap`, which this imports when it is needed."""

from __future__ import annotations

import io
import struct
from collections import Counter
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any, Final

from composer.recordings import metadata
from composer.recordings.recorded_topics import RawMessage, RecordedTopic, RecordingError, joined
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence
    from pathlib import Path

    from mcap.records import Channel, Schema

_MAGIC: Final = b'\x89MCAP0\r\n'


@record
class FileContent:
    """What a file has.

    Attributes:
        start_ns: The time of its first message; 0 if there is none.
        end_ns: That of the last one.
        problem: Why it ends too early; empty if it does not.
    """

    topics: Sequence[RecordedTopic]
    start_ns: int
    end_ns: int
    problem: str = ''


def read_content(path: Path) -> FileContent:
    """Read what a file has, but not its messages, unless it has no summary.

    Raises:
        RecordingError: It cannot be read, or is of another kind, or damaged.
    """
    from mcap.reader import make_reader

    with _reading(path) as stream:
        _check_magic(path, stream)
        summary = make_reader(stream).get_summary() if _has_end(stream) else None
        if summary is None or not (summary.statistics or summary.chunk_indexes):
            stream.seek(0)
            return _scan(path, stream)
        statistics, chunks = summary.statistics, summary.chunk_indexes
        counts: dict[int, int] | None = None
        start_ns = min((each.message_start_time for each in chunks), default=0)
        end_ns = max((each.message_end_time for each in chunks), default=0)
        if statistics is not None:
            counts = statistics.channel_message_counts
            start_ns, end_ns = statistics.message_start_time, statistics.message_end_time
        topics = _describe_topics(summary.channels, summary.schemas, counts)
        return FileContent(topics, start_ns, end_ns)


def _scan(path: Path, stream: IO[bytes]) -> FileContent:
    """Read all of a file that has no summary, up to where it ends."""
    from mcap.records import Channel, Message, Schema

    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    counts: Counter[int] = Counter()
    start_ns, end_ns = 0, 0
    problems: list[str] = []
    for each in _stream_records(path, stream, problems):
        if isinstance(each, Channel):
            channels[each.id] = each
        elif isinstance(each, Schema):
            schemas[each.id] = each
        elif isinstance(each, Message):
            counts[each.channel_id] += 1
            start_ns = min(start_ns or each.log_time, each.log_time)
            end_ns = max(end_ns, each.log_time)
    topics = _describe_topics(channels, schemas, counts)
    return FileContent(topics, start_ns, end_ns, ''.join(problems))


def _describe_topics(
    channels: Mapping[int, Channel],
    schemas: Mapping[int, Schema],
    counts: Mapping[int, int] | None,
) -> list[RecordedTopic]:
    found: dict[tuple[str, str], RecordedTopic] = {}
    for number, channel in channels.items():
        count = None if counts is None else counts.get(number, 0)
        topic = _describe_topic(channel, schemas.get(channel.schema_id), count)
        key = topic.name, topic.type
        found[key] = joined(found[key], topic) if key in found else topic
    return list(found.values())


def _describe_topic(channel: Channel, schema: Schema | None, count: int | None) -> RecordedTopic:
    encoding = channel.message_encoding
    type_name = _full_type_name(schema.name if schema else '')
    problem = ''
    if encoding != 'cdr':
        problem = f"its messages are in '{encoding}', not in the 'cdr' of ROS 2"
    elif not type_name:
        problem = 'its type was not recorded'
    is_text = schema is not None and schema.encoding == 'ros2msg'
    return RecordedTopic(
        channel.topic,
        type_name or (schema.name if schema else ''),
        count,
        metadata.read_qos(channel.metadata.get(metadata.QOS_KEY, '')),
        schema.data.decode(errors='replace') if schema is not None and is_text else '',
        channel.metadata.get(metadata.HASH_KEY, ''),
        problem,
    )


def _full_type_name(name: str) -> str:
    """Return the full name of a type, which writers other than rosbag2 shorten."""
    parts = name.split('/')
    if len(parts) == 2:  # noqa: PLR2004 - package and name
        parts.insert(1, 'msg')
    return '/'.join(parts) if len(parts) == 3 and all(parts) else ''  # noqa: PLR2004


def read_messages(
    path: Path,
    known: Mapping[tuple[str, str], RecordedTopic],
    topics: Collection[str] | None,
    since_ns: int | None,
) -> Iterator[RawMessage]:
    """Yield the messages of a file, if their topics are known and wanted; see `Recording`.

    Raises:
        RecordingError: It cannot be read, or is damaged.
    """
    wanted = {name for name, _ in known} if topics is None else set(topics)
    with _reading(path) as stream:
        for schema, channel, message in _iterate(path, stream, wanted, since_ns):
            name = _full_type_name(schema.name if schema else '')
            topic = known.get((channel.topic, name))
            if topic is not None:
                yield RawMessage(message.log_time, topic, message.data)


def _iterate(
    path: Path, stream: IO[bytes], wanted: set[str], since_ns: int | None
) -> Iterator[tuple[Any, Any, Any]]:
    from mcap.reader import make_reader

    reader = make_reader(stream, validate_crcs=True)
    summary = reader.get_summary() if _has_end(stream) else None
    if summary is not None and summary.chunk_indexes:
        yield from reader.iter_messages(wanted, starting_at=since_ns)
    else:
        stream.seek(0)
        yield from _iterate_unindexed(path, stream, wanted, since_ns or 0)


def _iterate_unindexed(
    path: Path, stream: IO[bytes], wanted: set[str], since_ns: int
) -> Iterator[tuple[Any, Any, Any]]:
    """Yield messages in the order of the file: to sort them would take all in memory."""
    from mcap.records import Channel, Message, Schema

    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    for each in _stream_records(path, stream, []):
        if isinstance(each, Channel):
            channels[each.id] = each
        elif isinstance(each, Schema):
            schemas[each.id] = each
        elif isinstance(each, Message) and each.log_time >= since_ns:
            channel = channels[each.channel_id]
            if channel.topic in wanted:
                yield schemas.get(channel.schema_id), channel, each


def _stream_records(path: Path, stream: IO[bytes], problems: list[str]) -> Iterator[Any]:
    """Yield the records of a file one after the other; note if it ends too early."""
    from mcap.stream_reader import StreamReader

    records = StreamReader(stream, validate_crcs=True).records
    while True:
        try:
            yield next(records)
        except StopIteration:
            return
        except _early_ends():
            problems.append(f"'{path}' was not completed: its recorder was killed")
            return


def _early_ends() -> tuple[type[Exception], ...]:
    """Return what the library raises where a file ends within a record."""
    from mcap.exceptions import EndOfFile

    return EndOfFile, struct.error


def _has_end(stream: IO[bytes]) -> bool:
    """Return whether a file was completed; otherwise its last bytes are anything."""
    size = stream.seek(0, io.SEEK_END)
    stream.seek(max(0, size - len(_MAGIC)))
    ending = stream.read()
    stream.seek(0)
    return ending == _MAGIC and size > len(_MAGIC)


def _check_magic(path: Path, stream: IO[bytes]) -> None:
    beginning = stream.read(len(_MAGIC))
    stream.seek(0)
    if beginning != _MAGIC:
        message = f"'{path}' is no MCAP file"
        raise RecordingError(message, help=_advice(path))


def _advice(path: Path) -> str | None:
    if path.suffix in {'.zstd', '.lz4'}:
        return f"it is compressed as a whole: '{path.suffix[1:]} -d {path}' makes the file of it"
    if path.suffix in {'.bag', '.db3'}:
        return "'rosbags-convert' of the package rosbags makes MCAP of it"
    return None


@contextmanager
def _reading(path: Path) -> Iterator[IO[bytes]]:
    """Open a file; what goes wrong with it in the block is a `RecordingError`."""
    from mcap.exceptions import McapError

    try:
        with path.open('rb') as stream:
            yield stream
    except OSError as error:
        message = f"'{path}' cannot be read: {error.strerror or error}"
        raise RecordingError(message) from error
    except Exception as error:
        if not isinstance(error, (McapError, *_damages())):
            raise
        message = f"'{path}' is damaged: {error}"
        raise RecordingError(message, help="'mcap recover' saves what can be read") from error


def _damages() -> tuple[type[Exception], ...]:
    """Return what the library and its decompressors raise where a file is damaged."""
    import zstandard

    # Errors of lz4 are RuntimeErrors; those of a CRC are ValueErrors.
    broken: type[Exception] = zstandard.ZstdError
    return (
        broken,
        struct.error,
        ValueError,
        LookupError,
        RuntimeError,
        MemoryError,
    )
