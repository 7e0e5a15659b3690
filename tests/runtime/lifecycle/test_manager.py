"""A manager as nav2's brings a mixed system up and down while members fail, die or hang."""

import os
import signal
import sys
from contextlib import suppress

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import State

from tests.running import ROOT, wait_for
from tests.runtime.lifecycle.manager import Manager, NotAvailableError

pytestmark = pytest.mark.ros

PROGRAM = ROOT / 'tests/runtime/lifecycle/managed_program.py'
CODE = """
import time
from pathlib import Path

def read(node, key):
    try:
        return Path('outcomes', f'{node.name}.{key}').read_text().strip()
    except OSError:
        return ''

def do(node, key):
    node.logger.info(key)
    outcome = read(node, key)
    while read(node, key) == 'hang':
        time.sleep(0.01)
    if outcome == 'error':
        raise OSError(key)
    return outcome != 'failure'

def work(node):
    while read(node, 'work') == 'hang':
        time.sleep(0.01)
    if read(node, 'work') == 'error':
        raise OSError('work')
"""
TRANSITIONS = ('on_configure', 'on_activate', 'on_deactivate', 'on_cleanup')
OURS = """
  %s:
    lifecycle: true
    bond: true
    warn_after: 0.5
    on_error: restart
    timers: {work: {period: 0.05, behaviour: 'parts:work'}}
"""
NAMES = ('first', 'middle', 'last')


def describe():
    behaviours = ''.join(
        f"    {key}: {{behaviour: 'parts:do', with: {{key: {key}}}}}\n" for key in TRANSITIONS
    )
    nodes = ''.join(OURS % name + behaviours for name in ('first', 'last'))
    command = [sys.executable, str(PROGRAM), 'middle', 'bond=yes']
    return f"""version: 1
executor: {{shutdown_timeout: 2}}
nodes:{nodes}
processes:
  middle: {{command: {command}, restart: {{when: always, delay: 0}}}}
"""


class Members:
    """The system and its manager; `outcomes` says what its members do."""

    def __init__(self, compose, bond_timeout_sec=1.5):
        self.folder = compose.folder / 'outcomes'
        self.folder.mkdir()
        self.child = compose(describe(), CODE)
        self.child.wait_until_ready()
        self.manager = Manager(NAMES, compose.domain_id, bond_timeout_sec)

    def let(self, member, key, outcome=''):
        path = self.folder / f'{member}.{key}'
        if outcome:
            path.write_text(outcome)
        else:
            path.unlink()

    def states(self):
        return [self.manager.state(name) for name in NAMES]

    def kill_middle(self):
        line = self.child.matching('[middle] pid ')[-1]
        os.kill(int(line.rpartition(' ')[2]), signal.SIGKILL)

    def is_unconfigured(self, name):
        with suppress(NotAvailableError):
            return self.manager.state(name) == State.PRIMARY_STATE_UNCONFIGURED
        return False

    def are_up(self):
        return self.states() == [State.PRIMARY_STATE_ACTIVE] * len(NAMES)


@pytest.fixture
def members(compose, interface_cache):
    running = Members(compose)
    yield running
    running.manager.close()


def play(members, member, key, outcome):
    """Have a member fail in one transition; the manager notices, and brings all up afterwards."""
    manager = members.manager
    members.let(member, key, outcome)
    if key in ('on_configure', 'on_activate'):
        assert not manager.startup()
        members.let(member, key)
        manager.reset(hard=True)
    else:
        assert manager.startup()
        assert not manager.reset()
        members.let(member, key)
        manager.reset(hard=True)
    assert manager.come_back()
    assert members.are_up()
    assert manager.reset()
    assert members.states() == [State.PRIMARY_STATE_UNCONFIGURED] * len(NAMES)


def test_members_that_fail_in_a_transition_are_told_and_come_back(members):
    play(members, 'last', 'on_deactivate', 'failure')
    play(members, 'first', 'on_activate', 'error')
    members.manager.shutdown()
    assert members.child.stop() == 0


def test_a_bond_tells_who_is_gone(members):
    for what in ('hangs', 'restarts', 'is killed'):
        tell_who_is_gone(members, what)
    assert members.child.stop() == 0


def tell_who_is_gone(members, what):
    manager = members.manager
    assert manager.startup()
    assert members.are_up()
    gone = 'middle' if what == 'is killed' else 'last'
    if what == 'is killed':
        members.kill_middle()
        # As long as DDS takes the dead one for alive, it gets the requests, too.
        wait_for(lambda: members.is_unconfigured('middle'), 'the restart')
    else:
        members.let('last', 'work', 'hang' if what == 'hangs' else 'error')
    assert wait_for(manager.find_broken, 'a broken bond') == gone
    if what != 'is killed':
        members.let('last', 'work')

    def is_back():
        # An attempt that meets the restart leaves those up that came before.
        return manager.come_back() or (manager.reset(hard=True) and False)

    wait_for(is_back, 'all to be up')
    assert members.are_up()
    assert manager.reset()
