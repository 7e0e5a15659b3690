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

def look(node):
    names = sorted(name for name in node.ros.get_node_names() if name[0] != '_')
    found = [name for name in names if name != 'peer']
    node.logger.info(f'{found}, {node.ros.count_publishers("/words")}')

def work(node):
    node.logger.info('begun')
    time.sleep(0.3)
    node.logger.info('done')

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


ORDERLY = """
    version: 1
    nodes:
      /left/arm:
        timers: {tick: {period: 0.01, behaviour: 'parts:tell'}}
        on_start: parts:look
        on_stop: {behaviour: 'parts:tell', with: {text: stops}}
      /right/arm:
        on_start: {behaviour: 'parts:tell_async', with: {text: starts}}
        on_stop: {behaviour: 'parts:tell_async', with: {text: stops}}
      late:
        on_start: {behaviour: 'parts:slow_tell', with: {text: starts}}
      slow:
        timers: {work: {period: 0.02, behaviour: 'parts:work'}}
        on_stop: {behaviour: 'parts:tell', with: {text: ended}}
      bad: {on_stop: 'parts:fail'}
      last:
        publishers: {words: {type: std_msgs/msg/String, external: true}}
        on_start: parts:wait_for_peer
        on_stop: parts:last_words
"""


def test_all_nodes_start_before_any_works_and_a_signal_stops_them_in_order(
    compose, peer, wait_for
):
    heard = peer.listen(String, 'words')
    child = compose(ORDERLY, CODE)
    child.wait_for_line('[left.arm]: tick')
    child.wait_for_line('begun')

    assert child.stop(signal.SIGTERM) == 0
    # All nodes are there when the first one starts.
    assert child.lines[:3] == [
        "[INFO] [left.arm]: ['arm', 'arm', 'bad', 'last', 'late', 'slow'], 1",
        '[INFO] [right.arm]: starts',
        '[INFO] [late]: starts',
    ]
    assert child.lines[3].startswith('[INFO] [composer]: system: 6 nodes ready in ')
    # What has begun comes to its end before its node stops.
    assert len(child.matching('begun')) == len(child.matching('done'))
    assert child.matching('[slow]: ')[-2:] == ['[INFO] [slow]: done', '[INFO] [slow]: ended']
    assert sorted(child.matching(': stops')) == [
        '[INFO] [left.arm]: stops',
        '[INFO] [right.arm]: stops',
    ]
    ticks = child.matching('[left.arm]: ')
    assert ticks[-2:] == ['[INFO] [left.arm]: tick', '[INFO] [left.arm]: stops']
    assert child.matching('[ERROR] [bad]: on_stop (system.yaml:16) raised OSError: no such device')
    assert wait_for(lambda: heard, 'the last words')[0].data == 'farewell'


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


def test_wrong_ros_arguments_are_a_usage_error(compose):
    child = compose('version: 1\nnodes: {a: {}}\n', '', '--ros-args', '-x', '3')

    assert child.wait() == 2
    assert child.lines[-1].startswith(
        "error: ROS 2 cannot start: it does not know the arguments ['-x', '3']"
    )


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
