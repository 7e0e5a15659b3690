"""`bond: true`: who manages a node hears its heart, and notices that it rests, hangs or is dead."""

import signal

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition

from tests.running import wait_for
from tests.runtime.lifecycle.bonds import Bond

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  robot:
    lifecycle: true
    bond: true
    warn_after: 0.3
    timers: {work: {period: 0.05, behaviour: 'parts:work'}}
"""
CODE = """
import time
from pathlib import Path

def work(node):
    while Path('hang').exists():
        time.sleep(0.01)
"""


def test_a_bond_tells_that_a_node_rests_hangs_or_is_dead(compose, peer, shared_cache, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(shared_cache))

    def form(timeout_sec):
        peer.change_state('robot', Transition.TRANSITION_ACTIVATE)
        bond = peer.run(Bond, peer.node, 'robot', timeout_sec)
        wait_for(lambda: bond.is_formed, 'the bond')
        return bond

    def rest(bond):
        peer.change_state('robot', Transition.TRANSITION_DEACTIVATE)
        wait_for(lambda: bond.is_broken, 'the word that it ends')
        peer.run(bond.end)

    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    peer.change_state('robot', Transition.TRANSITION_CONFIGURE)
    rest(form(float('inf')))
    bond = form(1.5)
    (compose.folder / 'hang').touch()
    wait_for(lambda: bond.is_broken, 'the silence of what hangs')
    (compose.folder / 'hang').unlink()
    wait_for(lambda: not bond.is_broken, 'its heart')
    # Each time that it is active it has a bond of its own.
    rest(bond)
    assert len(bond.instances) == 1
    bond = form(1.5)
    child.send(signal.SIGKILL)
    wait_for(lambda: bond.is_broken, 'the silence of the dead')
    peer.run(bond.end)
