"""Behaviours, and threads of their own, see that their node stops."""

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
executor: {shutdown_timeout: 20}
nodes:
  driver:
    worker: other
    state: {thread: null}
    on_start: parts:read
    timers: {wait: {period: 0.01, behaviour: parts:wait}}
    on_stop: parts:end
"""


def test_what_sleeps_ends_with_its_node_and_goes_on_with_a_new_one(compose):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_for_line('waits False')
    text = (compose.folder / 'system.yaml').read_text()
    (compose.folder / 'system.yaml').write_text(
        text.replace('state:', 'rosout: false\n    state:')
    )
    wait_for(lambda: len(child.matching('waits False')) == 2, child)
    assert child.matching('ends True')
    assert child.stop() == 0, child.output
    for said in ('has slept: False', 'the loop has ended', 'ends True'):
        assert len(child.matching(said)) == 2, child.output
