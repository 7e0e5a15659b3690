"""Write MCAP files with the library `mcap`: whole chunks, so that a killed process leaves some."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from mcap.writer import CompressionType, Writer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from io import FileIO

# Larger chunks are written at once.
CHUNK_SIZE: Final = 1 << 20


@dataclass(slots=True, eq=False)
class Channel:
    """A topic of one type in a file.

    Attributes:
        describe: Returns the name of the type, the encoding of its definition, the definition,
            and the metadata of the topic; called once, before its first message is written.
        number: As its messages refer to it; 0 until `describe` is called.
        type_name: Empty until then.
        about: The metadata of the topic; empty until then.
        count: How many messages the complete chunks have of it.
        pending: How many the current chunk has.
    """

    topic: str
    describe: Callable[[], tuple[str, str, bytes, Mapping[str, str]]]
    number: int = 0
    type_name: str = ''
    about: Mapping[str, str] = field(default_factory=dict)
    count: int = 0
    pending: int = 0


class McapWriter:
    """Writes one file.

    Args:
        stream: An unbuffered file, open for writing, at its beginning.
        library: What the header names as the writer.

    Attributes:
        channels: What was added, in this order; after `give_up`, what has messages.
        time_range: The times of the earliest and the latest message of complete chunks, in ns; or
            zeros.

    Raises:
        OSError: The file cannot be written; so do all methods that write. Then call `give_up`.
    """

    def __init__(self, stream: FileIO, library: str) -> None:
        self._stream = stream
        self.channels: list[Channel] = []
        self.time_range = 0, 0
        self._schemas: dict[tuple[str, bytes], int] = {}
        # Of the messages of the current chunk.
        self._times: list[int] = []
        self._size = 0
        # Only `flush` ends chunks: it counts what they have.
        self._writer: Any = Writer(
            stream, chunk_size=sys.maxsize, compression=CompressionType.NONE
        )
        self._writer.start('ros2', library)
        self._end = 0
        self.flush()

    @property
    def message_count(self) -> int:
        """How many messages the complete chunks have."""
        return sum(channel.count for channel in self.channels)

    def add_channel(
        self, topic: str, describe: Callable[[], tuple[str, str, bytes, Mapping[str, str]]]
    ) -> Channel:
        """Add a topic; see `Channel`."""
        channel = Channel(topic, describe)
        self.channels.append(channel)
        return channel

    def add_messages(self, entries: Iterable[tuple[Channel, int, int, bytes]]) -> None:
        """Add messages: for each its channel, when it was received and published, and its data."""
        add_message = self._writer.add_message
        for channel, log_ns, publish_ns, data in entries:
            if not channel.number:
                self._define(channel)
            add_message(channel.number, log_ns, data, publish_ns)
            channel.pending += 1
            self._times.append(log_ns)
            self._size += len(data)
            if self._size >= CHUNK_SIZE:
                self.flush()

    def flush(self) -> None:
        """Write the current chunk, if there are messages in it."""
        self._writer.flush()
        self._end = self._stream.tell()
        for channel in self.channels:
            channel.count += channel.pending
            channel.pending = 0
        if self._times:
            start_ns, end_ns = self.time_range if any(self.time_range) else (sys.maxsize, 0)
            self.time_range = min(start_ns, *self._times), max(end_ns, *self._times)
        self._times.clear()
        self._size = 0

    def define_all(self) -> None:
        """Define the topics without messages, too, and write what is left."""
        for channel in self.channels:
            if not channel.number:
                self._define(channel)
        self.flush()

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write what is left, metadata by their names, and the index."""
        self.define_all()
        for name, values in metadata.items():
            self._writer.add_metadata(name, dict(values))
        self._writer.finish()
        self._writer.flush()

    def give_up(self) -> None:
        """End a file that cannot be written any more: with its complete chunks, and no index."""
        self.channels = [channel for channel in self.channels if channel.count]
        self._stream.truncate(self._end)

    def _define(self, channel: Channel) -> None:
        """Add the records of a channel to the chunk of its first message."""
        name, encoding, data, channel.about = channel.describe()
        if (name, data) not in self._schemas:
            schema: int = self._writer.register_schema(name, encoding, data)
            self._schemas[name, data] = schema
        channel.type_name = name
        channel.number = self._writer.register_channel(
            channel.topic, 'cdr', self._schemas[name, data], dict(channel.about)
        )
