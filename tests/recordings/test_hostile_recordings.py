"""Recordings of others: nothing is written elsewhere, and nothing takes long or much memory."""

import os
import struct
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.writer import Writer

from tests.fuzz.test_hostile_files import run_limited

MAGIC = b'\x89MCAP0\r\n'
TEXT = b'\0\1\0\0\5\0\0\0text\0'
PARTED = 'x/Y a\n' + '=' * 80 + '\nMSG: {}\nstring data\n'
# A check has a bound of bytes; a replay reads on.
SLOW = 'to find the topics of the recording takes too long'
CASES = {}


def case(expected):
    """Add a function that writes a recording to the table, with what is said of it."""

    def add(function):
        CASES[function.__name__] = function, expected
        return function

    return add


def write_topics(path, topics=('/a',), kind='std_msgs/msg/String', text='string data\n', **more):
    times = more.pop('times', (5,))
    with path.open('wb') as stream:
        writer = Writer(stream, **more)
        writer.start()
        schema = writer.register_schema(kind, 'ros2msg', text.encode())
        for topic in topics:
            about = {'offered_qos_profiles': f'- history: 1\n  x: {topic}\n'}
            channel = writer.register_channel(topic, 'cdr', schema, about)
            for time_ns in times:
                writer.add_message(channel, time_ns, TEXT, time_ns)
        writer.finish()


def write_chunk(path, compression, data, claimed, *, times=1, end=b''):
    """Write a file without an index, with one chunk, so many times."""
    chunk = struct.pack('<QQQII', 1, 2, claimed, 0, len(compression)) + compression.encode()
    chunk += struct.pack('<Q', len(data)) + data
    header = b'\1' + struct.pack('<QII', 8, 0, 0)
    chunk = b'\6' + struct.pack('<Q', len(chunk)) + chunk
    path.write_bytes(MAGIC + header + chunk * times + end)


@case("has a part '../../escaped', which is no type of ROS")
def part_elsewhere(path):
    write_topics(path, kind='odd_msgs/msg/Odd', text=PARTED.format('../../escaped'))


@case('the definition of odd_msgs/msg/Odd has more than 2 MB')
def large_definition(path):
    write_topics(path, kind='odd_msgs/msg/Odd', text='a' * 3_000_000)


@case(r'\x1b')
def name_with_escapes(path):
    write_topics(path, ['/\x1b[2J'])


@case('at a time after the year 2262')
def endless_time(path):
    write_topics(path, times=[2**64 - 1])


@case('has more than')
def zstd_bomb(path):
    write_chunk(path, 'zstd', zstandard.compress(bytes(1_900_000_000)), 1_900_000_000)


@case('a chunk has more than it says')
def lying_lz4(path):
    write_chunk(path, 'lz4', lz4.frame.compress(bytes(1_000_000_000)), 1000)


@case('has nothing to publish')
def tiny_records(path):
    data = bytes(90_000_000)
    write_chunk(path, 'zstd', zstandard.compress(data), len(data))


@case(SLOW)
def many_zstd_bombs(path):
    data = bytes(90_000_000)
    write_chunk(path, 'zstd', zstandard.compress(data), len(data), times=1000)


@case(SLOW)
def many_lz4_bombs(path):
    data = bytes(30_000_000)
    write_chunk(path, 'lz4', lz4.frame.compress(data), len(data), times=20)


@case('is damaged')
def enormous_record(path):
    path.write_bytes(MAGIC + b'\x09' + struct.pack('<Q', 2**40) + bytes(100))


@case('not a regular file')
def fifo(path):
    os.mkfifo(path)


@case('not a regular file')
def device(path):
    path.symlink_to('/dev/zero')


@case('5,000 recorded types are not installed, and 500 are built at most')
def many_types(path):
    parts = ''.join(f'{"=" * 80}\nMSG: odd_msgs/T{each}\nstring data\n' for each in range(4999))
    write_topics(path, kind='odd_msgs/msg/Odd', text=f'string data\n{parts}')


@case('has nothing to publish')
def zeros(path):
    path.write_bytes(MAGIC)
    os.truncate(path, 300_000_000)


def write_folder(path, metadata):
    path.mkdir()
    write_topics(path / 'a.mcap')
    (path / 'metadata.yaml').write_text(metadata)


@case('more than')
def endless_aliases(path):
    levels = ''.join(f'a{i}: &a{i} [{", ".join([f"*a{i - 1}"] * 10)}]\n' for i in range(1, 10))
    text = f'a0: &a0 [x]\n{levels}rosbag2_bagfile_information: {{relative_file_paths: *a9}}\n'
    write_folder(path, text)


# Those that a check reads more of, or otherwise, than of a short file with a wrong word in it.
CHECKED = [name for name, (_, expected) in CASES.items() if expected == SLOW]
CHECKED += ['tiny_records', 'part_elsewhere', 'many_types', 'fifo', 'device', 'zeros']
CHECKED += ['lying_lz4', 'endless_aliases']

SCENARIO = """\
version: 1
system: {file: system.yaml}
cases:
  it:
    given: {recording: a.mcap}
    then: [{never: /none}]
    until: 1
"""
SYSTEM = """\
version: 1
nodes: {n: {publishers: {p: {type: std_msgs/msg/String, topic: /p, external: true}}}}
"""


@pytest.fixture(autouse=True)
def in_folder(tmp_path, monkeypatch):
    folder = tmp_path / 'one' / 'two' / 'three'
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    monkeypatch.setenv('TMPDIR', str(folder))
    return folder


def written(folder):
    """Return what there is beside the recording, in all folders above it."""
    return sorted(str(each) for each in folder.parents[2].rglob('*') if each.name != 'output.txt')


@pytest.mark.parametrize('name', CHECKED)
def test_a_check_of_a_scenario_is_done_in_seconds(name, in_folder):
    CASES[name][0](Path('a.mcap'))
    Path('a.scenario.yaml').write_text(SCENARIO)
    Path('system.yaml').write_text(SYSTEM)

    code, output = run_limited(in_folder, ['check', 'a.scenario.yaml'])

    assert code == 1, output
    assert 'a.scenario.yaml:5:24: error[' in output
    assert CASES[name][1] != SLOW or SLOW in output


@pytest.mark.ros
@pytest.mark.sampled
@pytest.mark.parametrize(
    'name', [each for each in CASES if each != 'tiny_records' and CASES[each][1] != SLOW]
)
def test_a_replay_says_what_is_wrong(name, in_folder):
    write, expected = CASES[name]
    write(Path('a.mcap'))
    before = written(in_folder)

    code, output = run_limited(in_folder, ['replay', 'a.mcap'], memory=600_000_000)

    assert code == 1, output
    assert expected in output
    assert written(in_folder) == before
