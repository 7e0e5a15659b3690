"""Read one MCAP file with the library `mcap`.

Its readers believe what chunks say about their size, and hold all records of one at once. So only
its parser of records is used here: files of anybody are read in bounded memory.
"""

from __future__ import annotations

import heapq
import io
import struct
import zlib
from collections import Counter
from contextlib import contextmanager, suppress
from typing import IO, TYPE_CHECKING, Final, cast

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, ChunkIndex, Footer, Message, Schema, Statistics
from mcap.stream_reader import StreamReader
from mcap.summary import Summary

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
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence
    from pathlib import Path

    from mcap.records import McapRecord

# A message of a chunk, beside its data.
_BYTES_OF_MESSAGE: Final = 500
# Of messages in chunks that overlap in time.
_MOST_HELD: Final = 4 * MAX_RECORDED_BYTES
# The year 2262; ROS has no later time.
_LAST_NS: Final = 2**63 - 1
_MAGIC: Final = b'\x89MCAP0\r\n'
# A complete file ends with a record of 29 bytes and the magic.
_END_BYTES: Final = 29 + len(_MAGIC)
# What follows the kind of a record.
_LENGTH_BYTES: Final = 8
# What the library and its decompressors raise; errors of lz4 are RuntimeErrors.
_DAMAGES: Final = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ArithmeticError,
    ValueError,
    LookupError,
    RuntimeError,
    MemoryError,
)


@record
class FileContent:
    """What a file has.

    Attributes:
        topics: One of several channels is there several times.
        start_ns: The time of its first message; 0 if there is none.
        end_ns: That of the last one.
        problem: Why it ends too early; empty if it does not.
    """

    topics: Sequence[RecordedTopic]
    start_ns: int
    end_ns: int
    problem: str = ''


class Budget:
    """How much is read and decompressed of recordings.

    Args:
        left: In bytes; `None` for as much as there is.
    """

    def __init__(self, left: int | None = None) -> None:
        self._left = left

    def spend(self, size: int) -> None:
        """Count what is read or decompressed.

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
    """A stream of which no more is read than a budget allows.

    Args:
        is_chunk: Whether its bytes are those of a chunk, which are counted already.
    """

    def __init__(self, stream: IO[bytes], budget: Budget, *, is_chunk: bool = False) -> None:
        self._stream, self._budget, self._is_chunk = stream, budget, is_chunk

    def read(self, size: int | None = None, /) -> bytes:
        size = -1 if size is None else size
        self._budget.spend(min(size, 0) if self._is_chunk else size)
        data = self._stream.read(size)
        if data == b'\0':
            rest = self._stream.read(_LENGTH_BYTES)
            self._stream.seek(-len(rest), io.SEEK_CUR)
            # No record is of this kind: a file system fills what was lost with zeros.
            return data if any(rest) else b''
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        return self._stream.seek(offset, whence)


def read_content(path: Path, budget: Budget) -> FileContent:
    """Read what a file has, but not its messages, unless it has no index.

    Raises:
        RecordingError: It cannot be read, or is of another kind, or damaged; or the budget is
            spent.
    """
    with _reading(path, budget) as stream:
        summary = _read_summary(stream)
        if summary is None:
            return _scan(path, stream, budget)
        counts: dict[int, int] | None = None
        start_ns = min((index.message_start_time for index in summary.chunk_indexes), default=0)
        end_ns = max((index.message_end_time for index in summary.chunk_indexes), default=0)
        if summary.statistics:
            counts = summary.statistics.channel_message_counts
            start_ns = summary.statistics.message_start_time
            end_ns = summary.statistics.message_end_time
        return FileContent(_describe_topics(summary, counts), start_ns, end_ns)


def read_messages(
    path: Path,
    known: Mapping[tuple[str, str], RecordedTopic],
    topics: Collection[str] | None,
    since_ns: int,
) -> Iterator[RawMessage]:
    """Yield the messages of a file, if their topics are known and wanted; see `Recording`.

    Raises:
        RecordingError: It cannot be read, or is damaged.
    """
    wanted = {key: known[key] for key in known if topics is None or key[0] in topics}
    with _reading(path, Budget()) as stream:
        summary = _read_summary(stream)
        if summary and summary.chunk_indexes:
            messages = _sort_messages(path, stream, summary, wanted, since_ns)
        else:
            # In the order of the file: to sort them would take all in memory.
            summary = Summary()
            messages = _stream_messages(path, stream, summary, [], Budget())
        for message in messages:
            topic = _find_topic(summary, message.channel_id, wanted)
            if topic is None or message.log_time < since_ns:
                continue
            if message.log_time > _LAST_NS:
                text = f"'{path}' has a message of '{topic.name}' at a time after the year 2262"
                raise RecordingError(text)
            yield RawMessage(message.log_time, topic, message.data)


def _read_summary(stream: IO[bytes]) -> Summary | None:
    """Return the summary of a complete file; `None` if there is none, at the file's beginning."""
    size = stream.seek(0, io.SEEK_END)
    stream.seek(max(0, size - _END_BYTES))
    ending = stream.read(_END_BYTES)
    stream.seek(0)
    if len(ending) < _END_BYTES or not ending.endswith(_MAGIC):
        return None
    footer = next(StreamReader(io.BytesIO(ending), skip_magic=True, emit_chunks=True).records)
    if not isinstance(footer, Footer) or not footer.summary_start:
        return None
    stream.seek(footer.summary_start)
    summary = Summary()
    # A summary that names the chunks themselves is not to decompress them.
    for entry in StreamReader(stream, skip_magic=True, emit_chunks=True).records:
        _note(summary, entry)
    stream.seek(0)
    return summary if summary.statistics or summary.chunk_indexes else None


def _note(summary: Summary, entry: McapRecord) -> None:
    if isinstance(entry, Channel):
        summary.channels.setdefault(entry.id, entry)
    elif isinstance(entry, Schema):
        summary.schemas.setdefault(entry.id, entry)
    elif isinstance(entry, ChunkIndex):
        summary.chunk_indexes.append(entry)
    elif isinstance(entry, Statistics):
        summary.statistics = entry


def _scan(path: Path, stream: IO[bytes], budget: Budget) -> FileContent:
    """Read all of a file that has no index, up to where it ends."""
    summary, problems = Summary(), list[str]()
    counts: Counter[int] = Counter()
    start_ns, end_ns = 0, 0
    for message in _stream_messages(path, stream, summary, problems, budget):
        counts[message.channel_id] += 1
        start_ns = min(start_ns or message.log_time, message.log_time)
        end_ns = max(end_ns, message.log_time)
    return FileContent(_describe_topics(summary, counts), start_ns, end_ns, ''.join(problems))


def _stream_messages(
    path: Path, stream: IO[bytes], summary: Summary, problems: list[str], budget: Budget
) -> Iterator[Message]:
    """Yield the messages of a file as they come; note its topics, and if it ends too early."""
    entries = StreamReader(stream, validate_crcs=True, emit_chunks=True).records
    while True:
        try:
            entry = next(entries, None)
        except (EndOfFile, struct.error):
            why = 'its recorder was killed, or its disk was full'
            problems.append(f"'{path}' was not completed: {why}")
            return
        if entry is None:
            return
        for part in _unpack(entry, budget) if isinstance(entry, Chunk) else [entry]:
            if isinstance(part, Message):
                yield part
            else:
                _note(summary, part)


def _sort_messages(
    path: Path,
    stream: IO[bytes],
    summary: Summary,
    wanted: Mapping[tuple[str, str], RecordedTopic],
    since_ns: int,
) -> Iterator[Message]:
    """Yield messages in the order of their times, holding no more chunks than have the same."""
    numbers = {each for each in summary.channels if _find_topic(summary, each, wanted)}
    chunks = {index.chunk_start_offset: index for index in summary.chunk_indexes}
    held: list[tuple[int, int, int, Message]] = []
    size = 0
    for offset, index in sorted(chunks.items(), key=lambda item: item[1].message_start_time):
        offsets = index.message_index_offsets
        if index.message_end_time < since_ns or (offsets and numbers.isdisjoint(offsets)):
            continue
        while held and held[0][0] < index.message_start_time:
            message = heapq.heappop(held)[-1]
            size -= len(message.data) + _BYTES_OF_MESSAGE
            yield message
        stream.seek(offset + 1 + _LENGTH_BYTES)
        chunk = Chunk.read(ReadDataStream(stream))
        for place, part in enumerate(_unpack(chunk, Budget())):
            if isinstance(part, Message) and part.channel_id in numbers:
                heapq.heappush(held, (part.log_time, offset, place, part))
                size += len(part.data) + _BYTES_OF_MESSAGE
            if size > _MOST_HELD:
                text = f"'{path}' has more than {format_size(_MOST_HELD)} in chunks of one time"
                raise RecordingError(text, help="'mcap sort' puts them in order")
    while held:
        yield heapq.heappop(held)[-1]


def _unpack(chunk: Chunk, budget: Budget) -> Iterator[McapRecord]:
    """Yield the records of a chunk."""
    data = chunk.data
    if chunk.compression:
        budget.spend(chunk.uncompressed_size)
        data = _decompress(chunk, chunk.uncompressed_size)
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        message = 'crc validation failed in a chunk'
        raise ValueError(message)
    stream = cast('IO[bytes]', _Counted(io.BytesIO(data), budget, is_chunk=True))
    with suppress(EndOfFile):
        yield from StreamReader(stream, skip_magic=True, emit_chunks=True).records


def _decompress(chunk: Chunk, size: int) -> bytes:
    data: bytes
    if chunk.compression == 'zstd':
        data = zstandard.ZstdDecompressor().stream_reader(chunk.data).read(size + 1)
    elif chunk.compression == 'lz4':
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, size + 1)
    else:
        message = f"a chunk is compressed as '{chunk.compression}'"
        raise ValueError(message)
    if len(data) > size:
        message = 'a chunk has more than it says'
        raise ValueError(message)
    return data


def _find_topic(
    summary: Summary, number: int, wanted: Mapping[tuple[str, str], RecordedTopic]
) -> RecordedTopic | None:
    channel = summary.channels[number]
    schema = summary.schemas.get(channel.schema_id)
    return wanted.get((channel.topic, full_type_name(schema.name if schema else '')))


def _describe_topics(
    summary: Summary, counts: Mapping[int, int] | None
) -> Sequence[RecordedTopic]:
    topics = []
    # Many topics may have the same one.
    definitions = {
        number: schema.data.decode(errors='replace')
        for number, schema in summary.schemas.items()
        if schema.encoding == 'ros2msg'
    }
    for number, channel in summary.channels.items():
        schema = summary.schemas.get(channel.schema_id)
        named = schema.name if schema else ''
        type_name, encoding = full_type_name(named), channel.message_encoding
        problem = find_topic_name_problem(channel.topic) or ''
        if encoding != 'cdr':
            problem = f"its messages are in '{encoding}', not in the 'cdr' of ROS 2"
        elif not type_name:
            problem = f"'{named}' is no type of ROS" if named else 'its type was not recorded'
        topic = RecordedTopic(
            channel.topic,
            type_name or named,
            None if counts is None else counts.get(number, 0),
            channel.metadata.get(metadata.QOS_KEY, ''),
            definitions.get(channel.schema_id, ''),
            channel.metadata.get(metadata.HASH_KEY, ''),
            problem,
        )
        topics.append(topic)
    return topics


@contextmanager
def _reading(path: Path, budget: Budget) -> Iterator[IO[bytes]]:
    """Open a file; what goes wrong with it in the block is a `RecordingError`."""
    try:
        with open_file(path) as stream:
            if stream.read(len(_MAGIC)) != _MAGIC:
                message = f"'{path}' is no MCAP file"
                raise RecordingError(message, help=_advice(path))
            yield cast('IO[bytes]', _Counted(stream, budget))
    except UnreadableFileError as error:
        message = f"'{path}': {error}"
        raise RecordingError(message) from error
    except OSError as error:
        message = f"'{path}' cannot be read: {error.strerror or error}"
        raise RecordingError(message) from error
    except _DAMAGES as error:
        # Errors of memory, and of an end, have no text.
        lack = 'too little memory' if isinstance(error, MemoryError) else 'a record ends too early'
        message = f"'{path}' is damaged: {str(error) or lack}"
        raise RecordingError(message, help="'mcap recover' saves what can be read") from error


def _advice(path: Path) -> str | None:
    if path.suffix in {'.zstd', '.lz4'}:
        return f"it is compressed as a whole: '{path.suffix[1:]} -d {path}' makes the file of it"
    if path.suffix in {'.bag', '.db3'}:
        return "'rosbags-convert' of the package rosbags makes MCAP of it"
    return None
