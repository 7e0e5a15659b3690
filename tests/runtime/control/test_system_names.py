"""One system of a name on one graph: on one host at once, on several as soon as they meet."""

import os
import subprocess
import sys
import time

import pytest

pytest.importorskip('rclpy')

from composer.runtime.control.name_claim import NameClaim, list_claims
from tests.running import DEADLINE_SEC

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  lonely:
    timers: {tick: {period: 1.0, behaviour: parts:tick}}
"""
CODE = """
def tick(node):
    pass
"""


def test_a_name_is_had_once_and_told_of(domain_id):
    first, second = (NameClaim('_composer_a', domain_id) for _ in range(2))
    elsewhere = NameClaim('_composer_a', domain_id + 100)
    assert first.take({'name': 'a', 'file': 'a.yaml'}) is None
    assert second.take({'name': 'a'}) == {'name': 'a', 'file': 'a.yaml', 'pid': os.getpid()}
    assert elsewhere.take({}) is None
    elsewhere.release()
    assert [each['name'] for each in list_claims(domain_id)] == ['a']
    first.release()
    assert list_claims(domain_id) == []
    assert second.take({'name': 'a'}) is None
    second.release()


def test_a_process_that_is_killed_or_stopped_has_a_name_no_longer_than_it_lives(domain_id):
    code = f"""
import os, signal
from composer.runtime.control.name_claim import NameClaim
NameClaim('_composer_a', {domain_id}).take({{}})
print('taken', flush=True)
if os.fork():
    os.kill(os.getpid(), signal.SIGSTOP)
os.close(1)
signal.pause()
"""
    child = subprocess.Popen([sys.executable, '-c', code], stdout=subprocess.PIPE, text=True)
    own = NameClaim('_composer_a', domain_id)
    try:
        assert child.stdout.readline() == 'taken\n'
        os.waitpid(child.pid, os.WUNTRACED)
        # It cannot answer.
        assert own.take({}) in ({'pid': child.pid}, {})
    finally:
        forked = subprocess.run(
            ['pgrep', '-P', str(child.pid)], capture_output=True, text=True, check=False
        )
        child.kill()
        child.communicate()
    # Its own child has inherited the socket, and lives.
    try:
        assert own.take({}) is None
    finally:
        own.release()
        os.kill(int(forked.stdout), 9)


def test_of_two_that_start_together_one_comes_up(compose):
    path = compose.write(SYSTEM, CODE)
    children = [compose.run(path.name) for _ in range(2)]
    deadline = time.monotonic() + DEADLINE_SEC
    while not (done := [each for each in children if each.matching('runs already')]):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    (refused,) = done
    (other,) = (each for each in children if each is not refused)
    assert refused.wait() == 1
    line = refused.wait_for_line("error: a system 'system' runs already on this ROS graph")
    assert f'pid {other.pid}, file {path}' in line
    assert not refused.matching(' ready in ')
    other.wait_until_ready()
    assert other.stop() == 0


def test_a_node_whose_name_is_on_the_graph_already_is_a_warning(compose, peer):
    child = compose(SYSTEM.replace('lonely', 'peer'), CODE)
    child.wait_for_line("a node '/peer' runs already on this ROS graph")
    assert child.stop() == 0
    assert len(child.matching('runs already')) == 1
