"""How systems come up, all of them or nothing, and how they go down."""

import os
import pty
import signal
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import String

from tests.running import DEADLINE_SEC, ROOT

pytestmark = pytest.mark.ros

CODE = """
import threading
import time
from pathlib import Path

def tell(node, text='tick'):
    node.logger.info(text)

def slow_tell(node, text):
    time.sleep(0.3)
    node.logger.info(text)

async def tell_async(node, text='async'):
    node.logger.info(text)

def fail(node):
    raise OSError('no such device')

def end(node, code=0):
    node.shutdown(code)

def hang(node):
    node.logger.info('hanging')
    threading.Event().wait()

async def hang_async(node):
    from rclpy.task import Future

    node.logger.info('hanging')
    await Future()

def last_words(node):
    node.publish('words', 'farewell')

def wait_for_peer(node):
    while not all(publisher.get_subscription_count() for publisher in node.ros.publishers
                  if publisher.topic_name == '/words'):
        time.sleep(0.01)
"""


@pytest.fixture
def hears_hang_ups():
    """Let children hear SIGHUP, which the tests may have been told to ignore, as by `nohup`."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_all_nodes_after_their_on_stop_with_exit_code_0(compose, number):
    text = """
        version: 1
        nodes:
          one:
            timers: {tick: {period: 0.02, behaviour: 'parts:tell'}}
            on_stop: {behaviour: 'parts:tell', with: {text: one stops}}
          two:
            on_stop: {behaviour: 'parts:tell_async', with: {text: two stops}}
    """
    child = compose(text, CODE)
    child.wait_for_line('tick')

    assert child.stop(number) == 0
    assert child.lines[0].startswith('[INFO] [composer]: system: 2 nodes ready in ')
    assert child.lines[0].endswith(' s')
    assert len(child.matching('[one]: one stops')) == 1
    assert len(child.matching('[two]: two stops')) == 1
    stopped = child.lines.index('[INFO] [one]: one stops')
    assert not [line for line in child.lines[stopped:] if line.endswith('tick')]


def test_what_on_stop_publishes_is_heard(compose, peer, wait_for):
    text = """
        version: 1
        nodes:
          talker:
            publishers: {words: std_msgs/msg/String}
            on_start: parts:wait_for_peer
            on_stop: parts:last_words
    """
    heard = peer.listen(String, 'words')
    child = compose(text, CODE)
    child.wait_until_ready()

    assert child.stop() == 0
    assert wait_for(lambda: heard, 'the last words')[0].data == 'farewell'


def test_on_start_of_all_nodes_comes_before_any_tick_of_any_node(compose):
    text = """
        version: 1
        nodes:
          early:
            timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}
            on_start: {behaviour: 'parts:tell', with: {text: early starts}}
          middle:
            on_start: {behaviour: 'parts:tell_async', with: {text: middle starts}}
          late:
            on_start: {behaviour: 'parts:slow_tell', with: {text: late starts}}
    """
    child = compose(text, CODE)
    child.wait_for_line('tick')

    assert child.lines[:3] == [
        '[INFO] [early]: early starts',
        '[INFO] [middle]: middle starts',
        '[INFO] [late]: late starts',
    ]
    assert ' ready in ' in child.lines[3]
    assert child.stop() == 0


def test_all_nodes_are_there_when_the_first_on_start_is_called(compose):
    text = """
        version: 1
        nodes:
          first: {on_start: 'parts:look'}
          last: {publishers: {words: std_msgs/msg/String}}
    """
    code = """
        def look(node):
            names = sorted(node.ros.get_node_names())
            node.logger.info(f'{names[-2:]}, {node.ros.count_publishers("/words")}')
    """
    child = compose(text, code)

    child.wait_for_line("[INFO] [first]: ['first', 'last'], 1")


def test_on_start_that_raises_tears_all_down_with_exit_code_1(compose):
    text = """
        version: 1
        nodes:
          good: {timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}}
          bad: {on_start: 'parts:fail'}
          last: {on_start: 'parts:tell'}
    """
    child = compose(text, CODE)

    assert child.wait() == 1
    assert child.lines[0] == (
        '[ERROR] [bad]: on_start (system.yaml:5) raised OSError: no such device'
    )
    assert child.lines[-1] == "error: node 'bad': on_start raised OSError('no such device')"
    assert not child.matching('tick')
    assert not child.matching('nodes ready')


def test_an_entity_that_cannot_be_created_tears_all_down_with_exit_code_1(compose, peer):
    # The two rules are right, each by itself; what they come to is no name for ROS.
    text = """
        version: 1
        nodes:
          good: {timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}}
          bad: {publishers: {words: {type: std_msgs/msg/String, external: true}}}
    """
    child = compose(text, CODE, '--ros-args', '-r', f'bad:words:=/{"w" * 300}')

    assert child.wait() == 1
    assert child.matching("error: node 'bad': ")
    assert not child.matching('tick')
    assert not child.matching('Traceback')


def test_a_behaviour_may_end_the_system_with_an_exit_code(compose):
    text = """
        version: 1
        nodes:
          ender:
            timers: {end: {period: 0.02, behaviour: 'parts:end', with: {code: 7}}}
            on_stop: {behaviour: 'parts:tell', with: {text: stopping}}
    """
    child = compose(text, CODE)

    assert child.wait() == 7
    assert child.lines[-1] == '[INFO] [ender]: stopping'


def test_on_start_may_end_the_system(compose):
    text = """
        version: 1
        nodes:
          ender: {on_start: {behaviour: 'parts:end', with: {code: 4}}}
          other: {timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}}
    """
    child = compose(text, CODE)

    assert child.wait() == 4
    assert child.lines == []


def test_what_hangs_at_the_stop_is_shown_with_its_stack_and_exit_code_1(compose):
    text = """
        version: 1
        executor: {shutdown_timeout: 3.0}
        nodes:
          stuck:
            timers: {hang: {period: 0.02, behaviour: 'parts:hang'}}
            on_stop: {behaviour: 'parts:tell', with: {text: stopping}}
          stuck_async:
            timers: {hang: {period: 0.02, behaviour: 'parts:hang_async'}}
            on_stop: {behaviour: 'parts:tell', with: {text: stopping}}
          stuck_at_the_end: {on_stop: 'parts:hang'}
          other:
            on_stop: {behaviour: 'parts:tell', with: {text: stopping}}
    """
    child = compose(text, CODE)
    child.wait_for_line('hanging', times=2)
    child.wait_until_ready()

    assert child.stop() == 1
    expected = [
        ("node 'stuck': timer 'hang'", 'threading.Event().wait()'),
        ("node 'stuck_async': timer 'hang'", 'await Future()'),
        ("node 'stuck_at_the_end': on_stop", 'threading.Event().wait()'),
    ]
    for entity, statement in expected:
        report = f'[ERROR] [composer]: {entity} did not end in time; it is at'
        begin = child.lines.index(report)
        stack = [line for line in child.lines[begin + 1 : begin + 5] if line.startswith('  ')]
        line = CODE[: CODE.index(statement)].count('\n') + 1
        assert any(f'parts.py", line {line}' in each for each in stack)
        assert f'      {statement}' in stack
    for node in ('stuck', 'stuck_async', 'other'):
        assert f'[INFO] [{node}]: stopping' in child.lines


def test_on_stop_that_raises_does_not_keep_the_others_from_stopping(compose):
    text = """
        version: 1
        nodes:
          bad: {on_stop: 'parts:fail'}
          good: {on_stop: {behaviour: 'parts:tell', with: {text: stopping}}}
    """
    child = compose(text, CODE)
    child.wait_until_ready()
    child.stop()

    child.wait_for_line('[ERROR] [bad]: on_stop (system.yaml:4) raised OSError: no such device')
    child.wait_for_line('[good]: stopping')


def test_a_second_signal_leaves_at_once(compose):
    text = """
        version: 1
        executor: {shutdown_timeout: 3600}
        nodes: {stuck: {timers: {hang: {period: 0.02, behaviour: 'parts:hang'}}}}
    """
    child = compose(text, CODE)
    child.wait_for_line('hanging')
    child.send(signal.SIGINT)
    child.send(signal.SIGTERM)

    assert child.wait() == 1


def test_a_signal_while_the_system_stops_by_itself_is_no_second_one(compose):
    text = """
        version: 1
        nodes: {only: {on_stop: 'parts:end', timers: {tick: {period: 0.02, behaviour: 'parts:quit'}}}}
    """
    code = """
import os
import time

def quit(node):
    node.shutdown(4)

def end(node):
    print('stopping', flush=True)
    while not os.path.exists('signalled'):
        time.sleep(0.01)
    print('stopped', flush=True)
"""
    child = compose(text, code)
    child.wait_for_line('stopping')
    child.send(signal.SIGTERM)
    (compose.folder / 'signalled').touch()

    assert child.wait() == 4
    assert child.lines[-1] == 'stopped'


def test_a_behaviour_that_ends_in_time_is_waited_for(compose):
    text = """
        version: 1
        nodes:
          slow:
            timers: {work: {period: 0.02, behaviour: 'parts:work'}}
            on_stop: {behaviour: 'parts:tell', with: {text: stopping}}
    """
    code = (
        CODE
        + """
def work(node):
    node.logger.info('begun')
    time.sleep(0.5)
    node.logger.info('done')
"""
    )
    child = compose(text, code)
    child.wait_for_line('begun')

    assert child.stop() == 0
    assert [line.rpartition(' ')[2] for line in child.lines[-2:]] == ['done', 'stopping']
    assert len(child.matching('begun')) == len(child.matching('done'))


def test_a_signal_while_on_start_runs_ends_the_start(compose):
    text = """
        version: 1
        executor: {shutdown_timeout: 3.0}
        nodes:
          stuck: {on_start: 'parts:hang'}
          other:
            on_start: {behaviour: 'parts:tell', with: {text: starting}}
            on_stop: {behaviour: 'parts:tell', with: {text: stopping}}
    """
    child = compose(text, CODE)
    child.wait_for_line('hanging')

    assert child.stop(once_up=False) == 1
    child.wait_for_line("node 'stuck': on_start did not end in time; it is at")
    assert not child.matching('nodes ready')
    assert not child.matching('starting')
    assert not child.matching('stopping'), 'what has not started has nothing to stop'


def test_a_module_that_cannot_be_imported_is_told_with_its_place_before_the_start(compose):
    text = """
        version: 1
        nodes:
          good: {timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}}
    """
    child = compose(text, 'import sys\nsys.exit(3)\ndef tell(node): pass\n')
    place = f'{compose.folder}/parts.py:2'

    assert child.wait() == 1
    assert child.lines == [
        f"system.yaml:4:52: error[broken-behaviour]: importing 'parts' raised SystemExit: 3 ({place})",
        "  4 |   good: {timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}}",
        '    |                                                    ^^^^^^^^^^',
        '',
    ]


def test_a_function_that_only_shows_at_import_is_held_against_its_call(compose):
    text = """
        version: 1
        nodes:
          bad: {timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}}
          worse: {on_start: 'parts:none'}
    """
    code = """
        tell = eval('lambda: None')
        none = eval('None')
    """
    child = compose(text, code)

    assert child.wait() == 1
    assert [line for line in child.lines if 'error[' in line] == [
        'system.yaml:4:57: error[bad-signature]: tell() is called as tell(node): '
        'too many positional arguments',
        "system.yaml:5:22: error[broken-behaviour]: parts has no function 'none'",
    ]


def test_a_broken_file_starts_nothing(compose):
    child = compose('version: 1\nnodes: {a: {tiemrs: {}}}\n')

    assert child.wait() == 1
    assert "did you mean 'timers'?" in child.output


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('-p', 'nonsense'), "failed to initialize rcl: Couldn't parse parameter override rule"),
        (('-x', '3'), "it does not know the arguments ['-x', '3']"),
    ],
)
def test_wrong_ros_arguments_are_a_usage_error(compose, arguments, message):
    child = compose('version: 1\nnodes: {a: {}}\n', '', '--ros-args', *arguments)

    assert child.wait() == 2
    assert child.lines[-1].startswith(f'error: ROS 2 cannot start: {message}')


LEAVE_A_FILE = """
import time
from pathlib import Path

def leave_a_file(node):
    Path('stopping').touch()
    time.sleep(0.5)
    Path('stopped').touch()
"""
LEAVING_A_FILE = """
version: 1
nodes: {only: {on_stop: 'parts:leave_a_file'}}
"""


IN_ITS_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.executable, [sys.executable, '-m', 'composer', 'up', sys.argv[1]])
"""


def environment_of(compose):
    return os.environ | {
        'ROS_DOMAIN_ID': str(compose.domain_id),
        'ROS_LOG_DIR': str(compose.folder / 'log'),
        'PYTHONPATH': str(ROOT),
    }


@pytest.mark.usefixtures('hears_hang_ups')
def test_the_end_of_the_terminal_stops_the_system(compose, start_program):
    path = compose.write(LEAVING_A_FILE, LEAVE_A_FILE)
    terminal, inner_end = pty.openpty()
    process = start_program(
        '-c',
        IN_ITS_TERMINAL,
        path.name,
        cwd=compose.folder,
        env=environment_of(compose),
        stdin=inner_end,
        stdout=inner_end,
        stderr=inner_end,
        start_new_session=True,
    )
    os.close(inner_end)
    output = b''
    while b' ready in ' not in output:
        output += os.read(terminal, 4096)
    os.close(terminal)
    assert process.wait(DEADLINE_SEC) == 0
    assert (compose.folder / 'stopped').exists()


@pytest.mark.usefixtures('hears_hang_ups')
def test_more_than_one_hang_up_is_no_reason_to_hurry(compose, wait_for):
    child = compose(LEAVING_A_FILE, LEAVE_A_FILE)
    child.wait_until_ready()
    child.send(signal.SIGHUP)
    wait_for((compose.folder / 'stopping').exists, 'the beginning of on_stop')

    assert child.stop(signal.SIGHUP) == 0
    assert (compose.folder / 'stopped').exists()


def test_a_system_that_ignores_hang_ups_goes_on(compose):
    text = """
        version: 1
        nodes: {only: {timers: {tick: {period: 0.02, behaviour: 'parts:tell'}}}}
    """
    path = compose.write(text, CODE)
    with subprocess.Popen(
        ['nohup', sys.executable, '-m', 'composer', 'up', path.name],
        cwd=compose.folder,
        env=environment_of(compose),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        try:
            next(line for line in process.stdout if ' ready in ' in line)
            process.send_signal(signal.SIGHUP)
            for _ in range(20):
                next(line for line in process.stdout if 'tick' in line)
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=DEADLINE_SEC)
        finally:
            process.kill()
    assert process.returncode == 0
