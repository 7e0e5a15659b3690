"""Records messages: whoever has one puts it in a queue, and a thread writes them to the file.

The thread wakes a few times a second, whatever comes: to wake it for each message would cost the
publishing thread more than to serialize the message.
"""

from __future__ import annotations

import threading
from collections import Counter, deque
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeAlias

from composer.errors import ComposerError
from composer.interfaces.classes import interface_name
from composer.recordings import metadata
from composer.recordings.definitions import ENCODING, full_definition, type_hash
from composer.recordings.recorded_topics import require_mcap
from composer.version import find_version

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from composer.recordings.mcap_writer import Channel
    from composer.recordings.recording_place import RecordingPlace

# A message: its channel, when it was received and published (ns since 1970), and its data.
Entry: TypeAlias = 'tuple[Channel, int, int, bytes]'

_PAUSE_SEC: Final = 0.05
# How long a killed recorder may have kept a message to itself.
_FLUSH_SEC: Final = 1.0
# How much may wait for a slow disk.
_MOST_BYTES: Final = 1 << 28
_FEWEST_MESSAGES: Final = 100
_MOST_MESSAGES: Final = 1_000_000
_AT_FIRST: Final = 20_000
_END_SEC: Final = 30.0


class Log(Protocol):
    """What tells the user what becomes of a recording."""

    def info(self, message: str) -> object:
        """Tell what is as it should be."""

    def warning(self, message: str) -> object:
        """Tell what may not be."""

    def error(self, message: str) -> object:
        """Tell what is not."""


class Queue(Protocol):
    """Takes messages."""

    def __len__(self) -> int:
        """Return how many wait."""

    def append(self, entry: Entry, /) -> None:
        """Take one."""


class Sink(Protocol):
    """What is done with messages of topics; see `Recorder`."""

    room: int
    lost: int

    @property
    def queue(self) -> Queue:
        """Takes the messages."""

    def open_channel(
        self, topic: str, message_class: type, offers: Iterable[Mapping[str, Any]]
    ) -> Channel:
        """Return the channel of a topic and type."""

    def finish(self, remarks: Iterable[str] = ()) -> None:
        """End."""


class Recorder:
    """Writes a recording from its creation until `finish`.

    Args:
        log: Gets what ends the recording too early, and what was recorded.

    Attributes:
        queue: Who has a message appends it, unless it has `room` messages.
        room: How many messages may wait; 0 if nothing is recorded any more.
        lost: How many were not appended as there was no room.

    Raises:
        UsageError: The place is taken, or not there.
        ComposerError: The file cannot be written, or the library for recordings is not installed.
    """

    def __init__(self, place: RecordingPlace, log: Log) -> None:
        require_mcap()
        from composer.recordings.mcap_writer import McapWriter

        self._place = place
        self._log = log
        self._stream = place.create()
        try:
            self._writer = McapWriter(self._stream, f'composer {find_version()}')
        except OSError as error:
            message = f"'{place.file}' cannot be written: {error.strerror or error}"
            raise ComposerError(message) from error
        self.queue: deque[Entry] = deque()
        self.room = _AT_FIRST
        self.lost = 0
        self._offers: dict[tuple[str, type], list[Mapping[str, Any]]] = {}
        self._channels: dict[tuple[str, type], Channel] = {}
        self._lock = threading.Lock()
        self._flushed = monotonic()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name='composer-recorder', daemon=True)
        self._thread.start()

    def open_channel(
        self, topic: str, message_class: type, offers: Iterable[Mapping[str, Any]]
    ) -> Channel:
        """Return the channel of a topic and type, of which there is one.

        Args:
            offers: The QoS of publishers of it; see `metadata.write_qos`. Those that are known
                when the first message is written are in the file.
        """
        key = topic, message_class
        with self._lock:
            known = self._offers.setdefault(key, [])
            known += [each for each in offers if each not in known]
            if key not in self._channels:
                self._channels[key] = self._writer.add_channel(
                    topic, lambda: _describe(message_class, known)
                )
            return self._channels[key]

    def finish(self, remarks: Iterable[str] = ()) -> None:
        """Write what is left, complete the file, and say what is in it.

        Args:
            remarks: What else there is to say of it.
        """
        self._ended.set()
        self._thread.join(_END_SEC)
        if not self._stream.closed:
            try:
                self._drain()
                self._complete()
            except OSError as error:
                self._fail(error)
        self._log.info(f"recorded {self._describe_content()} to '{self._place.target}'")
        if self.lost and self.room:
            self._log.error(f'the disk was too slow: {self.lost} more were not recorded')
        for remark in remarks:
            self._log.warning(remark)

    def _describe_content(self) -> str:
        """Return `12 messages of 3 topics`."""
        counts: Counter[str] = Counter()
        for channel in self._writer.channels:
            counts[channel.topic] += channel.count
        messages, topics = counts.total(), len(counts)
        return (
            f'{messages} message{"" if messages == 1 else "s"} '
            f'of {topics} topic{"" if topics == 1 else "s"}'
        )

    def _run(self) -> None:
        while not self._ended.wait(_PAUSE_SEC):
            try:
                self._drain()
                if monotonic() > self._flushed + _FLUSH_SEC:
                    self._writer.flush()
                    self._flushed = monotonic()
            except Exception as error:  # noqa: BLE001 - else what waits would fill the memory
                self._fail(error)
                return

    def _drain(self) -> None:
        """Write what waits in the queue; what comes meanwhile waits."""
        queue = self.queue
        entries = [queue.popleft() for _ in range(len(queue))]
        if not entries:
            return
        size = sum(len(entry[3]) for entry in entries) / len(entries)
        self.room = int(min(max(_MOST_BYTES / (size + 1), _FEWEST_MESSAGES), _MOST_MESSAGES))
        self._writer.add_messages(entries)

    def _complete(self) -> None:
        self._writer.define_all()
        described = metadata.describe_recording(self._writer, self._place.file.name)
        text = metadata.render_metadata(described, is_file=False)
        self._writer.finish({metadata.RECORD_NAME: {'serialized_metadata': text}})
        self._stream.close()
        self._place.write_metadata(metadata.render_metadata(described, is_file=True))

    def _fail(self, error: Exception) -> None:
        """End the recording: the file has what was written so far."""
        self.room = 0
        self.queue.clear()
        with suppress(OSError):
            self._writer.give_up()
        self._stream.close()
        reason = getattr(error, 'strerror', None) or error
        self._log.error(
            f"the recording has ended: '{self._place.file}' cannot be written: {reason}. "
            'What was recorded before is in it'
        )


def _describe(
    message_class: type, offers: Iterable[Mapping[str, Any]]
) -> tuple[str, str, bytes, Mapping[str, str]]:
    """Return what a file says of a topic; see `Channel`."""
    about = {
        metadata.QOS_KEY: metadata.render_qos(offers),
        metadata.HASH_KEY: type_hash(message_class),
    }
    name = interface_name(message_class)
    try:
        return name, ENCODING, full_definition(message_class).encode(), about
    except (ComposerError, OSError, ValueError):
        # Its messages can be read where the type is installed.
        return name, '', b'', about
