"""Recordings are read as they were written, and by other readers too."""

import sys
from collections import Counter

import pytest
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import CompressionType, IndexType, Writer

from composer.recordings.reading import read_recording
from composer.recordings.recorded_topics import RecordingError
from composer.recordings.recorder import Recorder
from composer.recordings.recording_place import RecordingPlace
from tests.recorded import QOS, write_recording

pytestmark = pytest.mark.ros
STRING = 'string data\n'


def strings(*texts):
    from std_msgs.msg import String

    return [String(data=each) for each in texts]


def test_every_kind_of_field_comes_back(tmp_path, all_messages):
    path = write_recording(tmp_path / 'all.mcap', all_messages, chunks=4)

    read = list(read_recording(path).messages())

    expected = [(topic, each) for topic, messages in all_messages.items() for each in messages]
    assert [(topic, message) for _, topic, message in read] == expected
    assert [time_ns for time_ns, _, _ in read] == [1000 + each for each in range(len(read))]


def test_other_readers_find_all_messages_with_their_checksums(tmp_path, all_messages):
    path = write_recording(tmp_path / 'all.mcap', all_messages, chunks=4)
    counts = {topic: len(messages) for topic, messages in all_messages.items()}

    for reader_class in (make_reader, NonSeekingReader):
        with path.open('rb') as stream:
            reader = reader_class(stream, validate_crcs=True)
            found = Counter(channel.topic for _, channel, _ in reader.iter_messages())
        assert found == counts
    with path.open('rb') as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == 'ros2'
        assert reader.get_summary().statistics.message_count == sum(counts.values())


def test_topics_say_their_type_count_and_qos(tmp_path):
    path = write_recording(tmp_path / 'a.mcap', {'/b': strings('x', 'y'), '/a': strings('z')})

    recording = read_recording(path)

    told = [(each.name, each.type, each.count, each.qos) for each in recording.topics]
    assert told == [
        ('/a', 'std_msgs/msg/String', 1, [QOS]),
        ('/b', 'std_msgs/msg/String', 2, [QOS]),
    ]
    assert (recording.start_ns, recording.end_ns, recording.problem) == (1000, 1002, '')


@pytest.mark.parametrize('cut', [20, 700])
def test_a_file_that_is_cut_off_has_what_its_complete_chunks_hold(tmp_path, cut):
    texts = [f'{number:03}' for number in range(100)]
    path = write_recording(tmp_path / 'a.mcap', {'/a': strings(*texts)}, chunks=10, closes=False)
    path.write_bytes(path.read_bytes()[:-cut])

    recording = read_recording(path)
    read = [each.data for _, _, each in recording.messages()]

    assert read == texts[: len(read)]
    assert len(read) in {80, 90, 100}
    assert recording.topics[0].count == len(read)
    assert (
        recording.problem
        == f"'{path}' was not completed: its recorder was killed, or its disk was full"
    )


def test_a_folder_is_read_file_by_file(tmp_path):
    write_recording(tmp_path / 'second.mcap', {'/a': strings('b')})
    write_recording(tmp_path / 'first.mcap', {'/a': strings('a')})
    (tmp_path / 'metadata.yaml').write_text(
        'rosbag2_bagfile_information:\n  relative_file_paths: [first.mcap, second.mcap]\n'
    )

    recording = read_recording(tmp_path)

    assert [each.data for _, _, each in recording.messages()] == ['a', 'b']
    assert [(each.name, each.count) for each in recording.topics] == [('/a', 2)]


@pytest.mark.parametrize('compression', list(CompressionType))
def test_compressed_chunks_are_read(tmp_path, compression):
    path = tmp_path / 'a.mcap'
    write_foreign(path, 'cdr', 'std_msgs/String', compression=compression)

    assert [each.data for _, _, each in read_recording(path).messages()] == ['text']


@pytest.mark.parametrize(
    ('encoding', 'type_name', 'problem'),
    [
        ('json', 'std_msgs/msg/String', "its messages are in 'json', not in the 'cdr' of ROS 2"),
        ('ros1', 'std_msgs/String', "its messages are in 'ros1', not in the 'cdr' of ROS 2"),
        ('cdr', '', 'its type was not recorded'),
    ],
)
def test_what_is_not_of_ros_2_is_named_and_left_out(tmp_path, encoding, type_name, problem):
    path = tmp_path / 'a.mcap'
    write_foreign(path, encoding, type_name)

    recording = read_recording(path)

    assert [each.problem for each in recording.topics] == [problem]
    assert list(recording.messages()) == []


def write_foreign(path, encoding, type_name, **options):
    """Write what another program could have written."""
    writer = Writer(str(path), **{'compression': CompressionType.NONE} | options)
    writer.start()
    schema = writer.register_schema(type_name, 'ros2msg', STRING.encode()) if type_name else 0
    channel = writer.register_channel('/a', encoding, schema)
    writer.add_message(channel, 5, b'\0\1\0\0\5\0\0\0text\0', 5)
    writer.finish()
    writer._Writer__stream.close()


def test_a_topic_of_another_definition_is_left_out(tmp_path):
    from composer.recordings.types import MessageTypes

    path = tmp_path / 'a.mcap'
    writer = Writer(str(path))
    writer.start()
    for number, text in enumerate(('string text\n', '# A comment.\nstring  data # the text\n')):
        schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', text.encode())
        channel = writer.register_channel(f'/t{number}', 'cdr', schema)
        writer.add_message(channel, 5, b'\0\1\0\0\5\0\0\0text\0', 5)
    writer.finish()
    writer._Writer__stream.close()

    recording = read_recording(path)

    assert [topic for _, topic, _ in recording.messages()] == ['/t1']
    assert MessageTypes(recording.topics).problems == {
        ('/t0', 'std_msgs/msg/String'): (
            'std_msgs/msg/String was recorded with another definition than the installed one'
        )
    }


def test_a_file_without_counts_or_without_an_index_is_read_all_the_same(tmp_path):
    for number, options in enumerate(
        ({'use_statistics': False}, {'use_chunking': False}, {'index_types': IndexType.NONE})
    ):
        path = tmp_path / f'{number}.mcap'
        write_foreign(path, 'cdr', 'std_msgs/String', **options)

        recording = read_recording(path)

        assert [each.data for _, _, each in recording.messages()] == ['text'], options
        assert recording.topics[0].count in {None, 1}
        assert (recording.start_ns, recording.end_ns, recording.problem) == (5, 5, '')


def test_damage_is_an_error_where_it_is_met(tmp_path):
    path = write_recording(tmp_path / 'a.mcap', {'/a': strings('first', 'second')}, chunks=2)
    data = bytearray(path.read_bytes())
    data[data.index(b'second')] ^= 1
    path.write_bytes(data)

    messages = read_recording(path).messages()

    assert next(messages)[2].data == 'first'
    with pytest.raises(RecordingError, match=f"^'{path}' is damaged: crc validation failed in"):
        next(messages)


@pytest.mark.parametrize(
    ('name', 'content', 'message', 'advice'),
    [
        ('absent.mcap', None, "there is no recording '{}'", 'name an MCAP file'),
        ('a.txt', b'text', "'{}' is no MCAP file", None),
        ('a.bag', b'#ROSBAG V2.0', "'{}' is no MCAP file", "'rosbags-convert' of the"),
        ('a.mcap', b'', "'{}' is no MCAP file", None),
        ('a.mcap.zstd', b'\x28\xb5\x2f\xfd', "'{}' is no MCAP file", 'it is compressed'),
    ],
)
def test_what_cannot_be_read_is_an_error(tmp_path, name, content, message, advice):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(RecordingError) as raised:
        read_recording(path)

    assert str(raised.value) == message.format(path)
    assert (raised.value.help or '').startswith(advice or '')


def test_without_the_library_a_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'mcap', None)
    path = tmp_path / 'a.mcap'

    for use in (lambda: read_recording(path), lambda: Recorder(RecordingPlace(path, path), None)):
        with pytest.raises(RecordingError, match='recordings need the package mcap') as it:
            use()
        assert it.value.help == "pip install 'rclpy-composer[record]'"
    assert not path.exists()
