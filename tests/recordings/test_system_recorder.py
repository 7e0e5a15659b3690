"""Running systems are recorded: every message once, however it goes, and nothing is changed."""

import re
import resource
import signal
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

import yaml
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from composer.recordings.reading import read_recording
from tests.running import ROOT

pytestmark = pytest.mark.ros

UNFINISHED = "'{}' was not completed: its recorder was killed, or its disk was full"
# Each number is published once; what the listener hears is published again.
SYSTEM = """
    version: 1
    nodes:
      counter:
        publishers: {numbers: std_msgs/msg/String}
        timers: {tick: {rate: 200, behaviour: parts:count}}
      echo:
        subscriptions: {numbers: {type: std_msgs/msg/String, behaviour: parts:echo}}
        publishers: {echoes: {type: std_msgs/msg/String, external: true}}
"""
CODE = """
    def count(node):
        node.state.number = getattr(node.state, 'number', 0) + 1
        node.publish('numbers', f'own {node.state.number}')

    def echo(node, message):
        node.publish('echoes', message.data)
"""


def numbers_of(texts, who='own'):
    return [int(each.split()[1]) for each in texts if each.startswith(who)]


def texts_of(path, topic='/numbers'):
    return [message.data for _, _, message in read_recording(path).messages([topic])]


def wait_until_recorded(wait_for, path, topic, count):
    wait_for(lambda: len(texts_of(path, topic)) >= count, f'{count} messages of {topic}')


def show_deliveries():
    """Return what a running system says of itself."""
    command = [sys.executable, '-m', 'composer', 'top', '--format', 'json']
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout


def test_each_message_is_recorded_once_and_handed_over_all_the_same(compose, tmp_path, wait_for):
    (tmp_path / 'metadata.yaml').write_text('of another recording')
    child = compose(SYSTEM, CODE, '--record', 'run.mcap')
    child.wait_until_ready()
    wait_until_recorded(wait_for, tmp_path / 'run.mcap', '/echoes', 100)
    shown = show_deliveries()
    assert child.stop() == 0

    numbers = numbers_of(texts_of(tmp_path / 'run.mcap'))
    assert numbers == list(range(1, len(numbers) + 1))
    echoes = numbers_of(texts_of(tmp_path / 'run.mcap', '/echoes'))
    assert echoes == numbers[: len(echoes)]
    assert len(numbers) - len(echoes) <= 1
    assert '"local"' in shown
    assert re.search(r"recorded \d+ messages of \d topics to 'run.mcap'$", child.lines[-1])
    assert (tmp_path / 'metadata.yaml').read_text() == 'of another recording'


def test_others_on_the_same_topic_are_recorded_too_and_nothing_twice(
    compose, tmp_path, wait_for, peer
):
    from std_msgs.msg import String

    child = compose(SYSTEM, CODE, '--record', 'run.mcap', '--topics', '/numbers')
    child.wait_until_ready()
    # No queue is full before a crowded machine looks at it.
    publisher = peer.advertise(String, '/numbers', 1000)
    # The echo, and the recorder that has found it.
    wait_for(lambda: publisher.get_subscription_count() == 2, 'the recorder')
    shown = show_deliveries()
    assert '"local"' in shown
    assert 'outside' not in shown
    # From now on, own messages are sent: to somebody outside.
    heard = peer.listen(String, '/numbers', 1000)
    wait_for(lambda: numbers_of(each.data for each in heard), 'what is sent')

    def count():
        return len(numbers_of((each.data for each in heard), 'other'))

    for number in range(200):
        # That of the echo holds ten.
        wait_for(lambda: count() > number - 5, 'the last ones')  # noqa: B023
        peer.run(publisher.publish, String(data=f'other {number}'))
    wait_for(lambda: count() == 200, 'all of them')
    first = len(heard)
    wait_for(lambda: len(heard) > first + 50, 'more of both')
    assert child.stop() == 0

    texts = texts_of(tmp_path / 'run.mcap')
    own = numbers_of(texts)
    assert own == list(range(1, len(own) + 1))
    assert numbers_of(texts, 'other') == list(range(200))


def test_a_system_that_is_rewired_is_recorded_as_it_becomes(compose, tmp_path, wait_for):
    child = compose(SYSTEM, CODE, '--record', 'run.mcap', '--watch')
    child.wait_until_ready()
    wait_until_recorded(wait_for, tmp_path / 'run.mcap', '/echoes', 20)
    compose.write(SYSTEM.replace('echoes', 'answers'), CODE.replace('echoes', 'answers'))
    wait_until_recorded(wait_for, tmp_path / 'run.mcap', '/answers', 20)
    assert child.stop() == 0

    path = tmp_path / 'run.mcap'
    numbers = numbers_of(texts_of(path))
    assert numbers == list(range(1, len(numbers) + 1))
    answers = numbers_of(texts_of(path, '/answers'))
    assert answers == list(range(answers[0], answers[0] + len(answers)))
    assert read_recording(path).topics[0].qos


def test_rosbags_and_mcap_open_what_was_recorded(compose, tmp_path, wait_for):
    child = compose(SYSTEM, CODE, '--record', 'bag')
    child.wait_until_ready()
    wait_until_recorded(wait_for, tmp_path / 'bag', '/numbers', 20)
    assert child.stop() == 0

    path = tmp_path / 'bag' / 'bag_0.mcap'
    with path.open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True)
        count = sum(1 for _ in reader.iter_messages())
        (about,) = reader.iter_metadata()
    assert about.name == 'rosbag2'
    told = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())
    told = told['rosbag2_bagfile_information']
    assert told == yaml.safe_load(about.metadata['serialized_metadata'])
    assert (told['message_count'], told['relative_file_paths']) == (count, ['bag_0.mcap'])
    for target in (tmp_path / 'bag', path):
        with AnyReader([target]) as bag:
            assert bag.message_count == count
            texts = [
                bag.deserialize(data, connection.msgtype).data
                for connection, _, data in bag.messages()
                if connection.topic == '/numbers'
            ]
        assert texts == texts_of(path)


def test_a_killed_system_leaves_what_it_had_written(compose, tmp_path, wait_for):
    child = compose(SYSTEM, CODE, '--record', 'run.mcap')
    child.wait_until_ready()
    path = tmp_path / 'run.mcap'
    wait_until_recorded(wait_for, path, '/numbers', 100)
    child.stop(signal.SIGKILL)

    recording = read_recording(path)
    numbers = numbers_of(texts_of(path))
    assert recording.problem == UNFINISHED.format(path)
    assert len(numbers) >= 100
    assert numbers == list(range(1, len(numbers) + 1))


def test_a_full_disk_ends_the_recording_and_not_the_system(compose, tmp_path, wait_for):
    code = CODE.replace("f'own {node.state.number}'", "f'own {node.state.number} ' + 'x' * 10000")
    path = compose.write(SYSTEM, code)
    child = compose.run(path, '--record', 'run.mcap')
    # A limit for files does what a full disk does, and needs no disk.
    resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (5_000_000, 5_000_000))
    line = child.wait_for_line('the recording has ended')
    assert line == (
        "[ERROR] [composer]: the recording has ended: 'run.mcap' cannot be written: "
        'File too large. What was recorded before is in it'
    )
    assert child.stop() == 0
    assert len(child.matching('the recording has ended')) == 1

    path = tmp_path / 'run.mcap'
    numbers = numbers_of(texts_of(path))
    assert len(numbers) > 100
    assert numbers == list(range(1, len(numbers) + 1))
    recording = read_recording(path)
    assert recording.problem == UNFINISHED.format(path)
    said = child.matching('composer]: recorded ')[0]
    assert f'recorded {sum(topic.count for topic in recording.topics)} messages of' in said


@pytest.mark.parametrize(
    ('options', 'code', 'lines'),
    [
        (
            ['--record', 'there.mcap'],
            2,
            [
                "error: 'there.mcap' exists, and is not overwritten",
                '  help: name another file for the recording',
            ],
        ),
        (
            ['--record', 'absent/run.mcap'],
            2,
            ["error: there is no folder 'absent' for the recording", '  help: mkdir -p absent'],
        ),
        (
            ['--topics', '/x'],
            2,
            ['error: --topics is for --record', '  help: name the file, as in --record run.mcap'],
        ),
    ],
)
def test_wrong_use_is_an_error_before_the_start(compose, tmp_path, options, code, lines):
    (tmp_path / 'there.mcap').write_bytes(b'')
    child = compose(SYSTEM, CODE, *options)

    assert (child.wait(), child.lines) == (code, lines)
    assert not (tmp_path / 'run.mcap').exists()
