"""A recording of which bytes are lost or wrong gives the messages before, or a `RecordingError`."""

from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer

from composer.recordings.reading import read_recording
from composer.recordings.recorded_topics import RecordingError

pytest.importorskip('mcap')

DATA = b'\0\1\0\0\5\0\0\0text\0'
COUNT = 6


@pytest.fixture(params=[CompressionType.NONE, CompressionType.ZSTD])
def whole(request, tmp_path):
    path = tmp_path / 'a.mcap'
    with path.open('wb') as stream:
        writer = Writer(stream, chunk_size=100, compression=request.param)
        writer.start()
        schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data\n')
        channels = [writer.register_channel(each, 'cdr', schema, {}) for each in ('/a', '/b')]
        for time_ns in range(1, COUNT + 1):
            writer.add_message(channels[time_ns % 2], time_ns, DATA, time_ns)
        writer.finish()
    return path


def times_in(path: Path, content: bytes) -> list[int] | None:
    """Return the times of the messages; `None` if it cannot be read."""
    path.write_bytes(content)
    try:
        recording = read_recording(path, is_bounded=True)
        return [each.time_ns for each in recording.raw_messages()]
    except RecordingError:
        return None


def test_a_recording_may_end_at_any_byte(whole):
    content = whole.read_bytes()
    every = list(range(1, COUNT + 1))
    assert times_in(whole, content) == every
    counts = []
    for size in range(0, len(content), 3):
        times = times_in(whole, content[:size] + bytes(50 * (size % 2)))
        if times is not None:
            assert times == every[: len(times)]
            counts.append(len(times))
    assert set(counts) >= {0, COUNT}


def test_any_byte_of_a_recording_may_be_wrong(whole):
    content = whole.read_bytes()
    read = [
        times_in(whole, content[:at] + bytes([content[at] ^ 0xFF]) + content[at + 1 :])
        for at in range(0, len(content), 3)
    ]
    assert None in read
