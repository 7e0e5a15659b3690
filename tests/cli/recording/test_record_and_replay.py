"""`composer record` writes what is on the graph, and `composer replay` publishes the same again."""

import signal
from collections import Counter
from contextlib import contextmanager

import pytest

pytest.importorskip('rclpy')

import itertools

from composer.cli.main import run as run_command
from composer.recordings.reading import read_recording
from tests.recorded import filled, write_recording

pytestmark = pytest.mark.ros

# Of the nodes of the commands themselves, and of others that begin to listen.
PARAMETER_EVENTS = '/parameter_events'


@pytest.fixture
def run(domain_id, tmp_path, monkeypatch, capsys):
    """Return a function that runs a command in the test's folder: its exit code and errors."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        code = run_command([*map(str, words)])
        return code, capsys.readouterr().err.splitlines()

    return run


@pytest.fixture
def recording(compose):
    """Return a context manager: `composer record` runs in it; its lines are there afterwards."""

    @contextmanager
    def recording(*words, number=signal.SIGINT):
        child = compose.start('record', *words)
        child.wait_for_line('recording to ')
        yield child.lines
        assert child.stop(number) == 0

    return recording


def contents(path):
    """Return the messages of a recording, in CDR, by topic and in their order.

    The middleware fills up what it sends to a multiple of four bytes.
    """
    found = {}
    for message in read_recording(path).raw_messages():
        if message.topic.name != PARAMETER_EVENTS:
            found.setdefault(message.topic.name, []).append(
                message.data + bytes(-len(message.data) % 4)
            )
    return found


def test_what_is_replayed_is_recorded_again_byte_by_byte(run, recording, tmp_path, all_messages):
    path = write_recording(tmp_path / 'all.mcap', all_messages)

    with recording('-o', 'again') as lines:
        code, told = run('replay', path, '--wait')

    assert (code, told[-1]) == (0, f'published {3 * len(all_messages)} messages')
    assert contents(tmp_path / 'again') == contents(path)
    assert lines[-1].endswith(" to 'again'")


def test_the_qos_is_that_of_the_recording(run, recording, tmp_path):
    from std_msgs.msg import String

    from tests import recorded

    path = tmp_path / 'a.mcap'
    policies = {'durability': 'transient_local', 'reliability': 'best_effort', 'depth': 77}
    before = dict(recorded.QOS)
    recorded.QOS.update(policies)
    try:
        write_recording(path, {'/a': [String(data='x')]})
    finally:
        recorded.QOS.update(before)

    with recording('-o', 'again.mcap', '--topics', '/a'):
        run('replay', path, '--wait')

    (topic,) = read_recording(tmp_path / 'again.mcap').topics
    (qos,) = topic.qos
    # Discovery does not tell the depth.
    assert {**qos, 'depth': 77} == {**qos, **policies}
    # Nobody sends a best-effort message again that is lost when its publisher ends.
    assert topic.count <= 1


def test_only_matching_topics_are_published_from_a_time_on(run, recording, tmp_path):
    from std_msgs.msg import String

    messages = [String(data=str(number)) for number in range(5)]
    path = write_recording(tmp_path / 'a.mcap', {'/a/x': messages, '/b/x': messages})

    with recording('-o', 'again.mcap', '--topics', '*/x'):
        _, told = run(
            *('replay', path, '--wait', '--topics', '/a/*', '--topics', 'nobody'),
            *('--start', '0.000000002'),
            *('--ros-args', '-r', '/a/x:=/c/x'),
        )

    assert [line for line in told if 'no topic' in line] == ["warning: no topic matches 'nobody'"]
    read = [
        (topic, each.data) for _, topic, each in read_recording(tmp_path / 'again.mcap').messages()
    ]
    assert read == [('/c/x', '2'), ('/c/x', '3'), ('/c/x', '4')]


def test_a_recording_keeps_its_times(run, recording, tmp_path):
    from mcap.writer import Writer

    path = tmp_path / 'a.mcap'
    writer = Writer(str(path))
    writer.start('ros2')
    schema = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data\n')
    channel = writer.register_channel('/a', 'cdr', schema)
    for time_ns in (0, 10**9, 4 * 10**9):
        writer.add_message(channel, time_ns, b'\0\1\0\0\5\0\0\0text\0', time_ns)
    writer.finish()
    writer._Writer__stream.close()

    with recording('-o', 'again.mcap', '--topics', '/a'):
        assert run('replay', path, '--wait', '--rate', '2')[0] == 0

    times = [each for each, _, _ in read_recording(tmp_path / 'again.mcap').messages()]
    distances = [(later - earlier) / 1e9 for earlier, later in itertools.pairwise(times)]
    # Late at most as much as a loaded machine makes it; never early.
    assert 0.4 < distances[0] < 1.2
    assert 1.4 < distances[1] < 2.2


def test_topics_that_cannot_be_published_are_named(run, tmp_path):
    from mcap.writer import Writer

    path = tmp_path / 'a.mcap'
    writer = Writer(str(path))
    writer.start()
    schema = writer.register_schema('absent_msgs/msg/Nothing', 'ros2idl', b'')
    good = writer.register_schema('std_msgs/msg/String', 'ros2msg', b'string data\n')
    for topic, encoding, number in (
        ('/a', 'cdr', schema),
        ('/b', 'protobuf', schema),
        ('/c', 'cdr', good),
    ):
        channel = writer.register_channel(topic, encoding, number)
        writer.add_message(channel, 5, b'\0\1\0\0\5\0\0\0text\0', 5)
    writer.finish()
    writer._Writer__stream.close()

    code, told = run('replay', path)

    assert code == 1
    assert told == [
        "warning: '/a' is not published: absent_msgs/msg/Nothing: the package 'absent_msgs' is not "
        'installed',
        "warning: '/b' is not published: its messages are in 'protobuf', not in the 'cdr' of ROS 2",
        f"replaying 1 topic of '{path}', 0.0 s",
        'published 1 message',
    ]


def test_types_that_are_not_installed_are_built_of_the_file(
    run, recording, tmp_path, shared_cache, monkeypatch
):
    from mcap.writer import Writer

    monkeypatch.setenv('XDG_CACHE_HOME', str(shared_cache))
    path = tmp_path / 'a.mcap'
    definition = (
        'Pair pair\nstd_msgs/String text\n'
        f'{"=" * 80}\nMSG: recorded_msgs/Pair\nint8 a\nint8 b\n'
        f'{"=" * 80}\nMSG: std_msgs/String\nstring data\n'
    )
    writer = Writer(str(path))
    writer.start('ros2')
    schema = writer.register_schema('recorded_msgs/msg/Both', 'ros2msg', definition.encode())
    channel = writer.register_channel('/a', 'cdr', schema)
    data = b'\0\1\0\0\1\2\0\0\5\0\0\0text\0'
    writer.add_message(channel, 5, data, 5)
    writer.finish()
    writer._Writer__stream.close()

    code, told = run('replay', path)
    assert (code, told[-1]) == (0, 'published 1 message')

    (read,) = read_recording(path).messages()
    assert (read[2].pair.a, read[2].pair.b, read[2].text.data) == (1, 2, 'text')


def test_the_default_is_a_new_folder_with_the_time_and_sigterm_ends_it(recording, tmp_path):
    """SIGINT is ignored at the start of what a script runs in the background, and ends it too."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with recording() as by_time, recording('-o', 'bag', number=signal.SIGTERM) as lines:
            pass
    finally:
        signal.signal(signal.SIGINT, before)
    assert by_time[0].startswith("recording to 'rosbag2_")
    assert lines[0] == "recording to 'bag'; Ctrl-C ends it"
    for folder in (tmp_path / 'bag', *tmp_path.glob('rosbag2_*')):
        assert sorted(each.suffix for each in folder.iterdir()) == ['.mcap', '.yaml']
    assert len([*tmp_path.glob('rosbag2_*')]) == 1


def test_topics_that_come_and_go_and_latched_messages_of_before_are_recorded(
    recording, peer, tmp_path, wait_for
):
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from std_msgs.msg import Int32, String

    profile = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = peer.run(peer.node.create_publisher, String, '/map', profile)
    for text in 'abc':
        peer.run(publisher.publish, String(data=text))
    topics = ('--topics', '/map', '--topics', '/early', '--topics', '/late')
    with recording('-o', 'a.mcap', *topics):
        wait_for(publisher.get_subscription_count, 'the recorder')
        wait_for(publisher.wait_for_all_acked, 'what it takes')
        for topic, kind in (('/early', String), ('/late', Int32)):
            publisher = peer.advertise(kind, topic)
            for _ in range(100):
                peer.run(publisher.publish, kind())
            wait_for(publisher.wait_for_all_acked, 'what is recorded')
            peer.run(peer.node.destroy_publisher, publisher)

    read = [*read_recording(tmp_path / 'a.mcap').messages()]
    assert [each.data for _, topic, each in read if topic == '/map'] == list('abc')
    counts = Counter(topic for _, topic, _ in read)
    assert counts == {'/map': 3, '/early': 100, '/late': 100}


def test_a_later_publisher_that_offers_less_is_told(recording, peer, tmp_path, wait_for):
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from std_msgs.msg import String

    with recording('-o', 'a.mcap', '--topics', '/mixed', '--topics', '/last') as lines:
        peer.advertise(String, '/mixed')
        profile = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        peer.run(peer.node.create_publisher, String, '/mixed', profile)
        # The recorder finds a later topic in the look in which it tells.
        peer.advertise(String, '/last')
    assert [line for line in lines if line.startswith('warning')] == [
        "warning: '/mixed' may be recorded in part: publishers that came later offer other "
        'reliability or durability than those before'
    ]


@pytest.mark.parametrize(
    ('words', 'code', 'lines'),
    [
        (['replay', 'a.mcap', '--topics', '/x'], 1, ["error: 'a.mcap' has nothing to publish"]),
        (['record', '-o', 'a.mcap'], 2, ["error: 'a.mcap' exists, and is not overwritten"]),
    ],
)
def test_wrong_use_is_an_error(run, tmp_path, words, code, lines):
    write_recording(tmp_path / 'a.mcap', {'/a': [filled(string_class())]})

    found, told = run(*words)

    errors = [line for line in told if line.startswith('error')]
    assert found == code
    assert [line[: len(lines[0])] for line in errors] == lines


def string_class():
    from std_msgs.msg import String

    return String
