"""What is written can be read by the library, and wherever the disk is full, what came before."""

import errno
import io

import pytest
from mcap.reader import NonSeekingReader, make_reader

from composer.recordings.mcap_writer import McapWriter
from composer.recordings.reading import read_recording

ABOUT = ('std_msgs/msg/String', 'ros2msg', b'string data\n', {'offered_qos_profiles': ''})


class Disk(io.FileIO):
    """A file on a disk with so much room."""

    def __init__(self, path, room=1 << 30):
        super().__init__(path, 'w')
        self.room = room

    def write(self, data):
        left = self.room - self.tell()
        if left <= 0:
            raise OSError(errno.ENOSPC, 'No space left on device')
        return super().write(data[:left])


def write(path, room):
    """Write 40 messages in 8 chunks, and what comes after them; return how many there were."""
    with Disk(path, room) as stream:
        writer = McapWriter(stream, 'test')
        try:
            for number in range(40):
                if number in {0, 17}:
                    channel = writer.add_channel(f'/topic_{number}', lambda: ABOUT)
                writer.add_messages([(channel, 100 + number, 50 + number, bytes([number]) * 30)])
                if number % 5 == 4:
                    writer.flush()
            assert writer.time_range == (100, 139)
            writer.add_channel('/silent', lambda: ABOUT)
            writer.finish({'rosbag2': {'serialized_metadata': 'all'}})
        except OSError:
            writer.give_up()
        topics = len(writer.channels)
    return writer.message_count, topics


@pytest.mark.parametrize('reader_class', [make_reader, NonSeekingReader])
def test_the_library_reads_what_is_written(tmp_path, reader_class):
    path = tmp_path / 'a.mcap'
    assert write(path, 1 << 30) == (40, 3)
    with path.open('rb') as stream:
        reader = reader_class(stream, validate_crcs=True)
        messages = [each for _, _, each in reader.iter_messages()]
    assert [each.name for each in read_recording(path).topics if not each.count] == ['/silent']
    assert [(each.log_time, each.publish_time, each.data) for each in messages] == [
        (100 + number, 50 + number, bytes([number]) * 30) for number in range(40)
    ]


def test_a_full_disk_leaves_the_chunks_before(tmp_path):
    path = tmp_path / 'a.mcap'
    write(path, 1 << 30)
    size = path.stat().st_size
    counts = set()
    # Smaller ones have no room for anything but the header.
    for room in range(100, size, 13):
        written = write(path, room)
        recording = read_recording(path)
        times = [each.time_ns for each in recording.raw_messages()]
        assert path.stat().st_size <= room
        assert times == [*range(100, 100 + len(times))]
        assert written == (len(times), len(recording.topics))
        assert recording.problem.endswith('its recorder was killed, or its disk was full')
        counts.add(len(times))
    assert counts == set(range(0, 41, 5))


def test_a_message_that_is_larger_than_a_chunk_is_written_whole(tmp_path):
    path = tmp_path / 'a.mcap'
    sizes = [10, 3_000_000, 10, 1 << 20, 10]
    with Disk(path) as stream:
        writer = McapWriter(stream, 'test')
        channel = writer.add_channel('/large', lambda: ABOUT)
        writer.add_messages([(channel, 5, 5, bytes(size)) for size in sizes])
        # The first chunks are in the file at once.
        (topic,) = read_recording(path).topics
        assert topic.count == 4
        writer.finish({})
    assert [len(each.data) for each in read_recording(path).raw_messages()] == sizes
