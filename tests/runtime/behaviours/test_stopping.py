"""Behaviours, and threads of their own, see that their node stops."""

import subprocess
import sys

import pytest

from tests.running import wait_for

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import threading


def read(node):
    node.state.thread = threading.Thread(target=loop, args=(node,))
    node.state.thread.start()


def loop(node):
    while not node.stopping:
        node.sleep(600)
    node.logger.info('the loop has ended')


def wait(node):
    node.logger.info(f'waits {bool(node.stopping)}')
    node.logger.info(f'has slept: {node.sleep(600)}')


def end(node):
    node.state.thread.join()
    node.logger.info(f'ends {bool(node.stopping)}')
"""
SYSTEM = """
version: 1
executor: {{shutdown_timeout: 20}}
{more}
nodes:
  driver:
    {place}
    state: {{thread: null}}
    on_start: parts:read
    timers: {{wait: {{period: 0.01, behaviour: parts:wait}}}}
    on_stop: parts:end
"""


def test_what_sleeps_ends_with_its_node(compose):
    child = compose(SYSTEM.format(place='worker: other', more=''), CODE)
    child.wait_for_line('waits False')
    assert child.stop() == 0, child.output
    for said in ('has slept: False', 'the loop has ended', 'ends True'):
        assert child.matching(said), child.output


def test_a_node_that_is_recreated_goes_on(compose):
    child = compose(SYSTEM.format(place='', more=''), CODE, '--watch')
    child.wait_for_line('waits False')
    text = (compose.folder / 'system.yaml').read_text()
    (compose.folder / 'system.yaml').write_text(
        text.replace('state:', 'rosout: false\n    state:')
    )
    wait_for(lambda: len(child.matching('waits False')) == 2, child)
    assert child.matching('ends True')
    assert child.stop() == 0, child.output


def test_it_sleeps_in_virtual_time(compose):
    (compose.folder / 'parts.py').write_text("""
def wait(node):
    begun = node.now()
    node.sleep(1000)
    node.logger.info(f'slept {(node.now() - begun).nanoseconds}')
""")
    (compose.folder / 'system.yaml').write_text("""
version: 1
nodes: {driver: {timers: {wait: {period: 1, behaviour: 'parts:wait'}}}}
""")
    (compose.folder / 'a.scenario.yaml').write_text("""
version: 1
system: {file: system.yaml}
cases: {it sleeps: {then: [{log: driver, text: slept 1000000000000}], until: 1100}}
""")
    command = [sys.executable, '-m', 'composer', 'test', 'a.scenario.yaml']
    done = subprocess.run(
        command, cwd=compose.folder, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stdout
