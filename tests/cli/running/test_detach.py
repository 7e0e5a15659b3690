"""`composer up --detach` gives the terminal back; `composer logs` shows what the system says."""

import os
import re
import signal
from contextlib import suppress

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run
from tests.cli.test_streams import end_without_reader

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
args: {word: hello}
nodes:
  talker:
    on_start: {behaviour: parts:start, with: {word: '{{ word }}'}}
"""
CODE = """
import time

def start(node, word):
    print(f'printed {word}')
    node.logger.info(f'logged {word}')
    if word == 'never':
        time.sleep(3600)
"""


@pytest.fixture
def detached(compose, monkeypatch, capfd):
    """Run `composer up --detach`; return its exit code and what it printed. All ends in the end."""
    monkeypatch.setenv('ROS_LOG_DIR', str(compose.folder / 'log'))
    pids = []

    def start(*words):
        child = compose.start('up', '--detach', *words)
        code = child.wait()
        found = re.search(r'^process (\d+), log (.*)\Z', child.output, re.MULTILINE)
        pids.extend([int(found[1])] if found else [])
        return code, child.output

    yield start
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def test_the_terminal_comes_back_when_all_is_up(compose, detached, capfd):
    path = compose.write(SYSTEM, CODE)
    code, output = detached(str(path), 'word:=hi')
    assert code == 0
    assert ' ready in ' in output
    assert run(['logs']) == 0
    text, _ = capfd.readouterr()
    assert 'printed hi' in text
    assert 'logged hi' in text
    follower = compose.start('logs', '-f', 'system')
    follower.wait_for_line('logged hi')
    domain = {'ROS_DOMAIN_ID': str(compose.domain_id)}
    assert end_without_reader(['logs', '-f', 'system'], compose.folder, **domain) == 0
    code, output = detached(str(path))
    assert code == 1
    assert "error: a system 'system' runs already on this ROS graph" in output
    assert run(['down']) == 0
    assert follower.wait() == 0
    capfd.readouterr()
    # It has ended, and its log is still there.
    assert run(['logs', 'system']) == 0
    assert capfd.readouterr()[0] == text
    assert run(['logs']) == 1
    assert capfd.readouterr()[1] == (
        f'error: no system runs on this host (ROS_DOMAIN_ID {compose.domain_id})\n'
    )


def test_what_does_not_come_up_is_told_where_it_was_started(compose, detached):
    code, output = detached(str(compose.write(SYSTEM.replace(':start', ':strat'), CODE)))
    assert code == 1
    assert 'error[unused-argument]' in output or 'error' in output
    assert not list((compose.folder / 'log').glob('composer_*'))


def test_an_interrupt_ends_what_has_not_come_up(compose, wait_for):
    path = compose.write(SYSTEM, CODE)
    child = compose.run(path.name, '--detach', 'word:=never')

    def said():
        return [each.read_text() for each in (compose.folder / 'log').glob('composer_*')]

    wait_for(lambda: any('logged never' in text for text in said()), 'its start')
    assert child.stop(once_up=False) == 130
    assert run(['down', '--timeout', '1']) == 1
