"""Read one MCAP file with the library `mcap`, which this imports when it is needed."""

from __future__ import annotations

import heapq
import io
import struct
import zlib
from collections import Counter
from contextlib import contextmanager, suppress
from typing import IO, TYPE_CHECKING, Any, Final, cast

from composer.input_limits import (
    BYTES_OF_RECORDED_VALUE,
    MAX_RECORDED_BYTES,
    UnreadableFileError,
    format_size,
    open_file,
)
from composer.names import find_topic_name_problem
from composer.recordings import metadata
from composer.recordings.recorded_topics import (
    RawMessage,
    RecordedTopic,
    RecordingError,
    full_type_name,
    joined,
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence
    from pathlib import Path

    from mcap.records import Channel, Chunk, Schema
    from mcap.summary import Summary

# A message of a chunk, beside its data.
_BYTES_OF_MESSAGE: Final = 500
# Of messages in chunks that overlap in time.
_MOST_HELD: Final = 4 * MAX_RECORDED_BYTES
# The year 2262; ROS has no later time.
_LAST_NS: Final = 2**63 - 1
_MAGIC: Final = b'\x89MCAP0\r\n'
# What follows the kind of a record.
_LENGTH_BYTES: Final = 8


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


class Budget:
    """How much is read of recordings.

    Args:
        left: In bytes; `None` for as much as there is.
    """

    def __init__(self, left: int | None = None) -> None:
        self._left = left

    def spend(self, size: int) -> None:
        """Count what is read.

        Raises:
            RecordingError: It is too much.
        """
        if not 0 <= size <= MAX_RECORDED_BYTES:
            message = (
                f'an entry has more than {format_size(MAX_RECORDED_BYTES)}, or less than none'
            )
            raise ValueError(message)
        if self._left is None:
            return
        self._left -= size + BYTES_OF_RECORDED_VALUE
        if self._left < 0:
            message = 'to find the topics of the recording takes too long'
            advice = "a smaller one does, or one with an index, which 'mcap recover' adds"
            raise RecordingError(message, help=advice)


class _Counted(io.BufferedIOBase):
    """A stream of which no more is read than a budget allows."""

    def __init__(self, stream: IO[bytes], budget: Budget) -> None:
        self._stream, self._budget = stream, budget

    def read(self, size: int | None = None, /) -> bytes:
        size = -1 if size is None else size
        self._budget.spend(size)
        data = self._stream.read(size)
        if data == b'\0':
            rest = self._stream.read(_LENGTH_BYTES)
            self._stream.seek(-len(rest), io.SEEK_CUR)
            # No record is of this kind: a file system fills what was lost with zeros.
            return data if any(rest) else b''
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        return self._stream.seek(offset, whence)


def read_content(path: Path, budget: Budget | None = None) -> FileContent:
    """Read what a file has, but not its messages, unless it has no summary.

    Raises:
        RecordingError: It cannot be read, or is of another kind, or damaged; or the budget is
            spent.
    """
    from mcap.reader import SeekingReader

    budget = budget or Budget()
    with _reading(path, budget) as stream:
        _check_magic(path, stream)
        summary = SeekingReader(stream).get_summary() if _has_end(stream) else None
        if summary is None or not (summary.statistics or summary.chunk_indexes):
            stream.seek(0)
            return _scan(path, stream, budget)
        statistics, chunks = summary.statistics, summary.chunk_indexes
        counts: dict[int, int] | None = None
        start_ns = min((each.message_start_time for each in chunks), default=0)
        end_ns = max((each.message_end_time for each in chunks), default=0)
        if statistics is not None:
            counts = statistics.channel_message_counts
            start_ns, end_ns = statistics.message_start_time, statistics.message_end_time
        topics = _describe_topics(summary.channels, summary.schemas, counts)
        return FileContent(topics, start_ns, end_ns)


def _scan(path: Path, stream: IO[bytes], budget: Budget) -> FileContent:
    """Read all of a file that has no summary, up to where it ends."""
    from mcap.records import Channel, Message, Schema

    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    counts: Counter[int] = Counter()
    start_ns, end_ns = 0, 0
    problems: list[str] = []
    for each in _stream_records(path, stream, problems, budget):
        if isinstance(each, Channel):
            channels.setdefault(each.id, each)
        elif isinstance(each, Schema):
            schemas.setdefault(each.id, each)
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
    # Many topics may have the same one.
    definitions = {
        number: each.data.decode(errors='replace')
        for number, each in schemas.items()
        if each.encoding == 'ros2msg'
    }
    for number, channel in channels.items():
        count = None if counts is None else counts.get(number, 0)
        definition = definitions.get(channel.schema_id, '')
        topic = _describe_topic(channel, schemas.get(channel.schema_id), definition, count)
        key = topic.name, topic.type
        found[key] = joined(found[key], topic) if key in found else topic
    return list(found.values())


def _describe_topic(
    channel: Channel, schema: Schema | None, definition: str, count: int | None
) -> RecordedTopic:
    encoding = channel.message_encoding
    type_name = full_type_name(schema.name if schema else '')
    problem = find_topic_name_problem(channel.topic) or ''
    if encoding != 'cdr':
        problem = f"its messages are in '{encoding}', not in the 'cdr' of ROS 2"
    elif not type_name:
        named = schema.name if schema else ''
        problem = f"'{named}' is no type of ROS" if named else 'its type was not recorded'
    return RecordedTopic(
        channel.topic,
        type_name or (schema.name if schema else ''),
        count,
        channel.metadata.get(metadata.QOS_KEY, ''),
        definition,
        channel.metadata.get(metadata.HASH_KEY, ''),
        problem,
    )


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
    with _reading(path, Budget()) as stream:
        for schema, channel, message in _iterate(path, stream, wanted, since_ns or 0):
            name = full_type_name(schema.name if schema else '')
            topic = known.get((channel.topic, name))
            if topic is not None and message.log_time > _LAST_NS:
                text = f"'{path}' has a message of '{topic.name}' at a time after the year 2262"
                raise RecordingError(text)
            if topic is not None:
                yield RawMessage(message.log_time, topic, message.data)


def _iterate(
    path: Path, stream: IO[bytes], wanted: set[str], since_ns: int
) -> Iterator[tuple[Any, Any, Any]]:
    from mcap.reader import SeekingReader

    summary = SeekingReader(stream).get_summary() if _has_end(stream) else None
    if summary is not None and summary.chunk_indexes:
        yield from _iterate_indexed(path, stream, summary, wanted, since_ns)
    else:
        stream.seek(0)
        yield from _iterate_unindexed(path, stream, wanted, since_ns)


def _iterate_indexed(
    path: Path, stream: IO[bytes], summary: Summary, wanted: set[str], since_ns: int
) -> Iterator[tuple[Any, Any, Any]]:
    """Yield messages in the order of their times, holding no more chunks than have the same."""
    from mcap.records import Chunk, Message
    from mcap.stream_reader import StreamReader

    ids = {number for number, each in summary.channels.items() if each.topic in wanted}
    chunks = {each.chunk_start_offset: each for each in summary.chunk_indexes}
    queue: list[tuple[int, int, int, Message | None]] = [
        (each.message_start_time, offset, -1, None)
        for offset, each in chunks.items()
        if each.message_end_time >= since_ns
        and not (each.message_index_offsets and ids.isdisjoint(each.message_index_offsets))
    ]
    heapq.heapify(queue)
    held = 0
    while queue:
        _, offset, _, message = heapq.heappop(queue)
        if message is not None:
            held -= len(message.data) + _BYTES_OF_MESSAGE
            channel = summary.channels[message.channel_id]
            yield summary.schemas.get(channel.schema_id), channel, message
            continue
        stream.seek(offset)
        chunk = next(StreamReader(stream, skip_magic=True, emit_chunks=True).records)
        if not isinstance(chunk, Chunk):
            text = 'its index names a chunk that is none'
            raise ValueError(text)  # noqa: TRY004 - a damage
        for index, each in enumerate(_unpack(chunk, Budget())):
            if isinstance(each, Message) and each.channel_id in ids and each.log_time >= since_ns:
                held += len(each.data) + _BYTES_OF_MESSAGE
                heapq.heappush(queue, (each.log_time, offset, index, each))
                if held > _MOST_HELD:
                    size = format_size(_MOST_HELD)
                    text = f"'{path}' has more than {size} in chunks of the same time"
                    raise RecordingError(text, help="'mcap sort' puts them in order")


def _iterate_unindexed(
    path: Path, stream: IO[bytes], wanted: set[str], since_ns: int
) -> Iterator[tuple[Any, Any, Any]]:
    """Yield messages in the order of the file: to sort them would take all in memory."""
    from mcap.records import Channel, Message, Schema

    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    for each in _stream_records(path, stream, [], Budget()):
        if isinstance(each, Channel):
            channels.setdefault(each.id, each)
        elif isinstance(each, Schema):
            schemas.setdefault(each.id, each)
        elif isinstance(each, Message) and each.log_time >= since_ns:
            channel = channels[each.channel_id]
            if channel.topic in wanted:
                yield schemas.get(channel.schema_id), channel, each


def _stream_records(
    path: Path, stream: IO[bytes], problems: list[str], budget: Budget
) -> Iterator[Any]:
    """Yield the records of a file one after the other; note if it ends too early."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    records = StreamReader(stream, validate_crcs=True, emit_chunks=True).records
    while True:
        try:
            each = next(records)
        except StopIteration:
            return
        except _early_ends():
            problems.append(f"'{path}' was not completed: its recorder was killed")
            return
        yield from _unpack(each, budget) if isinstance(each, Chunk) else [each]


def _unpack(chunk: Chunk, budget: Budget) -> Iterator[Any]:
    """Yield the records of a chunk.

    The library believes what a chunk says about its size, and holds all its records at once.
    """
    from mcap.exceptions import EndOfFile
    from mcap.stream_reader import StreamReader

    data = _decompress(chunk)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        message = 'crc validation failed in a chunk'
        raise ValueError(message)
    stream = cast('IO[bytes]', _Counted(io.BytesIO(data), budget))
    with suppress(EndOfFile):
        yield from StreamReader(stream, skip_magic=True, emit_chunks=True).records


def _decompress(chunk: Chunk) -> bytes:
    size = chunk.uncompressed_size
    if max(size, len(chunk.data)) > MAX_RECORDED_BYTES:
        message = f'a chunk has more than {format_size(MAX_RECORDED_BYTES)}'
        raise ValueError(message)
    data = chunk.data
    if chunk.compression == 'zstd':
        import zstandard

        data = zstandard.ZstdDecompressor().stream_reader(data).read(size + 1)
    elif chunk.compression == 'lz4':
        import lz4.frame

        data = lz4.frame.LZ4FrameDecompressor().decompress(data, size + 1)
    elif chunk.compression:
        message = f"a chunk is compressed as '{chunk.compression}'"
        raise ValueError(message)
    if len(data) > size:
        message = 'a chunk has more than it says'
        raise ValueError(message)
    return data


def _early_ends() -> tuple[type[Exception], ...]:
    """Return what the library raises where a file ends within a record."""
    from mcap.exceptions import EndOfFile

    return EndOfFile, struct.error


def _has_end(stream: IO[bytes]) -> bool:
    """Return whether a file was completed; otherwise its last bytes are anything."""
    size = stream.seek(0, io.SEEK_END)
    stream.seek(max(0, size - len(_MAGIC)))
    ending = stream.read(len(_MAGIC))
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
def _reading(path: Path, budget: Budget) -> Iterator[IO[bytes]]:
    """Open a file; what goes wrong with it in the block is a `RecordingError`."""
    from mcap.exceptions import McapError

    try:
        with open_file(path) as stream:
            yield cast('IO[bytes]', _Counted(stream, budget))
    except UnreadableFileError as error:
        message = f"'{path}': {error}"
        raise RecordingError(message) from error
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
        ArithmeticError,
        ValueError,
        LookupError,
        RuntimeError,
        MemoryError,
    )
