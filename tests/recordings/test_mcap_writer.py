"""Wherever the disk is full, the file is complete: it has the first messages, and an index."""

import errno
import io

import pytest
from mcap.reader import NonSeekingReader, make_reader

from composer.recordings.mcap_writer import McapWriter

ABOUT = ('std_msgs/msg/String', 'ros2msg', b'string data\n', {'offered_qos_profiles': ''})


class FullDisk(io.BytesIO):
    """A file on a disk with so much room."""

    def __init__(self, room):
        super().__init__()
        self.room = room

    def write(self, data):
        left = self.room - self.tell()
        if left <= 0:
            raise OSError(errno.ENOSPC, 'No space left on device')
        return super().write(data[:left])


def write(stream):
    """Write 40 messages in 8 chunks, and what comes after them; return how many there were."""
    writer = McapWriter(stream, 'test')
    try:
        for number in range(40):
            if number in {0, 17}:
                channel = writer.add_channel(f'/topic_{number}', lambda: ABOUT)
            writer.add_messages([(channel, 100 + number, 50 + number, bytes([number]) * 30)])
            if number % 5 == 4:
                writer.flush()
        writer.add_metadata('rosbag2', {'serialized_metadata': 'all'})
        writer.finish()
    except OSError:
        writer.give_up()
    return writer.message_count


def read(stream, reader_class):
    stream.seek(0)
    reader = reader_class(stream, validate_crcs=True)
    return [(each.log_time, each.publish_time, each.data) for _, _, each in reader.iter_messages()]


WHOLE = io.BytesIO()
write(WHOLE)
SIZE = len(WHOLE.getvalue())


@pytest.mark.parametrize('reader_class', [make_reader, NonSeekingReader])
def test_a_full_disk_leaves_a_complete_file(reader_class):
    expected = read(WHOLE, reader_class)
    assert len(expected) == 40
    found = set()
    # Smaller ones have no room for anything but the header.
    for room in range(300, SIZE + 1, 7):
        stream = FullDisk(room)
        count = write(stream)
        messages = read(stream, reader_class)
        assert len(stream.getvalue()) <= room
        assert messages == expected[: len(messages)]
        assert len(messages) == count
        stream.seek(0)
        statistics = make_reader(stream).get_summary().statistics
        assert statistics.message_count == count
        assert sum(statistics.channel_message_counts.values()) == count
        found.add(count)
    assert found == set(range(0, 41, 5))


def test_a_message_that_is_larger_than_a_chunk_is_written_whole():
    stream = io.BytesIO()
    writer = McapWriter(stream, 'test')
    channel = writer.add_channel('/large', lambda: ABOUT)
    sizes = [10, 3_000_000, 10, 1 << 20, 10]
    writer.add_messages([(channel, 5, 5, bytes(size)) for size in sizes])
    writer.finish()
    assert [len(data) for _, _, data in read(stream, make_reader)] == sizes


def test_topics_without_messages_are_in_the_summary():
    stream = io.BytesIO()
    writer = McapWriter(stream, 'test')
    writer.add_channel('/silent', lambda: ABOUT)
    writer.finish()
    stream.seek(0)
    summary = make_reader(stream).get_summary()
    assert [each.topic for each in summary.channels.values()] == ['/silent']
    assert read(stream, NonSeekingReader) == []
