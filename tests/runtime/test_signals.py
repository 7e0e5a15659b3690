"""Signals at any moment: before a system is up, and while its process exits."""

import os
import signal
import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from tests.running import ROOT

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes: {n: {on_start: 'parts:start'}}
"""
AT_IMPORT = """
import contextlib
import time

with contextlib.suppress(BaseException):
    print('busy', flush=True)
    # Python handles a signal that comes just before a sleep only after it.
    while True:
        time.sleep(0.05)

def start(node):
    pass
"""
IN_ON_START = """
import os
import time

def start(node):
    print('busy', flush=True)
    while not os.path.exists('signalled'):
        time.sleep(0.05)
"""
# A thread's wait, atexit, and what Python does after it.
AT_EXIT = """
import atexit
import sys
import threading
import time

class Late:
    def __del__(self, sleep=time.sleep, write=sys.stderr.write, flush=sys.stderr.flush):
        write('busy very late\\n')
        flush()
        sleep(0.5)

@atexit.register
def linger():
    print('busy at exit', flush=True)
    time.sleep(0.5)

sys.modules['late'] = Late()

def start(node):
    node.shutdown(4)
"""


def test_before_the_system_runs_a_signal_ends_all_at_once(compose):
    """Whatever is being imported, and whatever that catches."""
    child = compose(SYSTEM, AT_IMPORT)
    child.wait_for_line('busy')

    assert child.stop(once_up=False) == 130
    assert child.lines == ['busy']


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_while_the_system_starts_only_ctrl_c_is_no_success(compose, number):
    child = compose(SYSTEM, IN_ON_START)
    child.wait_for_line('busy')
    child.send(number)
    (compose.folder / 'signalled').touch()

    assert child.wait() == (130 if number == signal.SIGINT else 0)
    assert child.lines == ['busy']


@pytest.mark.parametrize('moment', ['busy at exit', 'busy very late'])
def test_while_the_process_exits_the_code_is_that_of_the_stop(compose, moment):
    child = compose(SYSTEM, AT_EXIT)
    child.wait_for_line(moment)

    assert child.stop(signal.SIGTERM) == 4
    assert not child.matching('Traceback')
    assert not child.matching('ignored')


PRINTING = """
def start(node):
    print('one', 'two', 'three', sep='\\n', flush=True)
"""


def test_a_system_ends_when_nobody_reads_its_output(compose):
    path = compose.write(SYSTEM, PRINTING)
    script = '("$0" -m composer up "$1"; echo "$?" >code) | head -n 2'
    result = subprocess.run(
        ['sh', '-c', script, sys.executable, path.name],
        cwd=compose.folder,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'ROS_LOG_DIR': str(compose.folder)},
        capture_output=True,
        text=True,
        timeout=200,
        check=True,
    )

    assert result.stdout == 'one\ntwo\n'
    assert (compose.folder / 'code').read_text() == '1\n'
    said = [line for line in result.stderr.splitlines() if line.startswith('[ERROR]')]
    assert len(said) == 1
