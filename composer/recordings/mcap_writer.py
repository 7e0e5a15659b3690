"""Write MCAP files: whole chunks only, so that what a killed process leaves can be read.

The writer of the library `mcap` takes longer for a message than all else that recording it costs.
Only what there is one of for each message is written here; all other records are the library's.
The format: https://mcap.dev/spec
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from typing import IO, TYPE_CHECKING, Any, Final

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel as ChannelRecord
from mcap.records import (
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

MAGIC: Final = b'\x89MCAP0\r\n'
# Larger chunks are written at once.
CHUNK_SIZE: Final = 1 << 20
_MESSAGE: Final = struct.Struct('<BQHIQQ')
# Of the type and length of a record, which its length does not count.
_RECORD_START: Final = 9
_CHUNK: Final = struct.Struct('<BQQQQIIQ')
_INDEX: Final = struct.Struct('<BQHI')
_FOOTER_START: Final = struct.Struct('<BQQQ')
_LENGTH_OF_FOOTER: Final = 20


@dataclass(slots=True, eq=False)
class Channel:
    """A topic of one type in a file.

    Attributes:
        number: As its messages refer to it.
        describe: Returns the name of the type, the encoding of its definition, the definition,
            and the metadata of the topic; called once, before its first message is written.
        record: Its record in the file; `None` until then.
        schema: That of its type.
        count: How many messages the complete chunks have of it.
        index: Times and places of its messages in the current chunk, one after the other.
    """

    number: int
    topic: str
    describe: Callable[[], tuple[str, str, bytes, Mapping[str, str]]]
    record: ChannelRecord | None = None
    schema: Schema | None = None
    count: int = 0
    index: list[int] = field(default_factory=list)


class McapWriter:
    """Writes one file.

    Args:
        stream: An unbuffered file, open for writing, at its beginning.
        library: What the header names as the writer.

    Attributes:
        channels: What was added, in this order; after `give_up`, what has messages.

    Raises:
        OSError: The file cannot be written; so do all methods that write. `give_up` then makes it
            a complete file of what has been written.
    """

    def __init__(self, stream: IO[bytes], library: str) -> None:
        self._stream = stream
        self.channels: list[Channel] = []
        self._schemas: dict[tuple[str, bytes], Schema] = {}
        self._chunks: list[tuple[ChunkIndex, dict[int, int]]] = []
        self._metadata: list[MetadataIndex] = []
        # The current chunk, of this size; the same memory is used again and again.
        self._chunk = bytearray(CHUNK_SIZE)
        self._size = 0
        self._end = 0
        self._write([MAGIC, _serialize([Header('ros2', library)])])

    @property
    def message_count(self) -> int:
        """How many messages there are."""
        return sum(each.count for each in self.channels)

    @property
    def time_range(self) -> tuple[int, int]:
        """The times of the earliest and the latest message of complete chunks, in ns; or zeros."""
        starts = [index.message_start_time for index, _ in self._chunks]
        ends = [index.message_end_time for index, _ in self._chunks]
        return min(starts, default=0), max(ends, default=0)

    def add_channel(
        self, topic: str, describe: Callable[[], tuple[str, str, bytes, Mapping[str, str]]]
    ) -> Channel:
        """Add a topic; see `Channel`."""
        channel = Channel(len(self.channels) + 1, topic, describe)
        self.channels.append(channel)
        return channel

    def add_messages(self, entries: Iterable[tuple[Channel, int, int, bytes]]) -> None:
        """Add messages: for each its channel, when it was received and published, and its data."""
        pack_into, chunk, size = _MESSAGE.pack_into, self._chunk, self._size
        for channel, log_ns, publish_ns, data in entries:
            if channel.record is None:
                self._size = size
                self._define(channel)
                size = self._size
            channel.index += (log_ns, size)
            length, begin = len(data), size + _MESSAGE.size
            end = begin + length
            if end > len(chunk):
                chunk.extend(bytes(end - len(chunk)))
            # As rosbag2, without a sequence number.
            pack_into(
                chunk, size, 5, end - size - _RECORD_START, channel.number, 0, log_ns, publish_ns
            )
            chunk[begin:end] = data
            size = end
            if size >= CHUNK_SIZE:
                self._size = size
                self.flush()
                size = 0
        self._size = size

    def flush(self) -> None:
        """Write the current chunk, if there are messages in it."""
        used = [each for each in self.channels if each.index]
        if not used:
            return
        times = [time for each in used for time in each.index[::2]]
        start_ns, end_ns = min(times), max(times)
        size = self._size
        records = memoryview(self._chunk)[:size]
        head = _CHUNK.pack(6, 40 + size, start_ns, end_ns, size, zlib.crc32(records), 0, size)
        indices, offsets, place = [], {}, self._end + len(head) + size
        for channel in used:
            packed = _pack_index(channel)
            offsets[channel.number] = place
            place += len(packed)
            indices.append(packed)
        index = ChunkIndex(
            chunk_length=len(head) + size,
            chunk_start_offset=self._end,
            compression='',
            compressed_size=size,
            message_end_time=end_ns,
            message_index_length=sum(map(len, indices)),
            message_index_offsets=offsets,
            message_start_time=start_ns,
            uncompressed_size=size,
        )
        counts = {each.number: len(each.index) // 2 for each in used}
        self._forget_chunk()
        with records:
            self._write([head, records, *indices])
        self._chunks.append((index, counts))
        for channel in used:
            channel.count += counts[channel.number]

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record after what was added so far."""
        self.flush()
        data = _serialize([Metadata(name=name, metadata=dict(values))])
        index = MetadataIndex(offset=self._end, length=len(data), name=name)
        self._write([data])
        self._metadata.append(index)

    def define_all(self) -> None:
        """Write the topics without messages: the summary may only repeat."""
        self.flush()
        for channel in self.channels:
            if channel.record is None:
                self._define(channel)
        defined = bytes(self._chunk[: self._size])
        self._forget_chunk()
        self._write([defined])

    def finish(self) -> None:
        """Write what is left, and the summary, by which readers find messages."""
        self.define_all()
        self._write_end()

    def give_up(self) -> None:
        """Complete a file that cannot be written any more: of as many chunks as there is room for.

        The messages of the others are lost.
        """
        self._forget_chunk()
        while True:
            self._recount()
            self._stream.truncate(self._end)
            self._stream.seek(self._end)
            try:
                self._write_end()
            except OSError:
                if not self._chunks:
                    raise
                index, _ = self._chunks.pop()
                self._end = index.chunk_start_offset
                self._metadata = [each for each in self._metadata if each.offset < self._end]
            else:
                return

    def _define(self, channel: Channel) -> None:
        """Add the records of a channel to the chunk of its first message."""
        name, encoding, data, metadata = channel.describe()
        schema = self._schemas.get((name, data))
        records: list[Any] = []
        if schema is None:
            schema = Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name)
            self._schemas[name, data] = schema
            records.append(schema)
        record = ChannelRecord(channel.number, channel.topic, 'cdr', dict(metadata), schema.id)
        channel.record, channel.schema = record, schema
        written = _serialize([*records, record])
        self._chunk[self._size : self._size + len(written)] = written
        self._size += len(written)

    def _forget_chunk(self) -> None:
        self._size = 0
        for channel in self.channels:
            channel.index.clear()

    def _recount(self) -> None:
        """Count only the messages of complete chunks, and only the channels with any."""
        for channel in self.channels:
            channel.count = sum(counts.get(channel.number, 0) for _, counts in self._chunks)
        self.channels = [each for each in self.channels if each.count]

    def _write_end(self) -> None:
        data_end = _serialize([DataEnd(0)])
        start = self._end + len(data_end)
        summary, offsets = self._summarize(start)
        offset_start = start + len(summary)
        summary += _serialize(offsets)
        # The CRC covers the footer up to itself.
        head = _FOOTER_START.pack(Opcode.FOOTER, _LENGTH_OF_FOOTER, start, offset_start)
        footer = Footer(start, offset_start, zlib.crc32(head, zlib.crc32(summary)))
        self._write([data_end, summary, _serialize([footer]), MAGIC])

    def _summarize(self, start: int) -> tuple[bytes, list[SummaryOffset]]:
        used = {each.schema.id: each.schema for each in self.channels if each.schema}
        start_ns, end_ns = self.time_range
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self.channels),
            channel_message_counts={each.number: each.count for each in self.channels},
            chunk_count=len(self._chunks),
            message_count=self.message_count,
            message_end_time=end_ns,
            message_start_time=start_ns,
            metadata_count=len(self._metadata),
            schema_count=len(used),
        )
        groups: list[tuple[Opcode, list[Any]]] = [
            (Opcode.SCHEMA, list(used.values())),
            (Opcode.CHANNEL, [each.record for each in self.channels]),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, [index for index, _ in self._chunks]),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        summary, offsets = b'', []
        for opcode, records in groups:
            data = _serialize(records)
            if data:
                offsets.append(SummaryOffset(opcode, start + len(summary), len(data)))
            summary += data
        return summary, offsets

    def _write(self, parts: list[bytes | memoryview]) -> None:
        for part in parts:
            left = memoryview(part)
            while left:
                left = left[self._stream.write(left) :]
        self._end += sum(map(len, parts))


def _serialize(records: Iterable[Any]) -> bytes:
    builder: Any = RecordBuilder()
    for each in records:
        each.write(builder)
    data: bytes = builder.end()
    return data


def _pack_index(channel: Channel) -> bytes:
    index = channel.index
    size = 8 * len(index)
    return _INDEX.pack(7, 6 + size, channel.number, size) + struct.pack(f'<{len(index)}Q', *index)
