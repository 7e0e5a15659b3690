"""What belongs to the system as a whole changes while it runs, or starts all of it again."""

import signal

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import String

pytestmark = pytest.mark.ros

# It all would take a quarter of an hour, if it stayed like that.
BEFORE = """
version: 1
executor: {threads: 1, shutdown_timeout: 900}
diagnostics: false
nodes:
  one: {timers: {meet: {period: 0.05, behaviour: parts:meet}}}
  two: {timers: {meet: {period: 0.05, behaviour: parts:meet}}}
  hanging: {subscriptions: {words: {type: std_msgs/msg/String, behaviour: parts:hang}}}
processes:
  deaf:
    command: [sh, -c, "trap '' INT TERM; echo deaf; while true; do sleep 0.1; done"]
    stop: {timeout: 900}
"""
AFTER = (
    BEFORE.replace('threads: 1, shutdown_timeout: 900', 'threads: 3, shutdown_timeout: 0.3')
    .replace('diagnostics: false', 'diagnostics: {period: 900}')
    .replace('timeout: 900}', 'timeout: 0.2}')
)
CODE = """
import threading

both = threading.Barrier(2)

def meet(node):
    try:
        both.wait(0.2)
    except threading.BrokenBarrierError:
        node.logger.info('alone')
        both.reset()
    else:
        node.logger.info('together')

def hang(node, message):
    node.logger.info('hanging')
    threading.Event().wait(900)
"""


def test_threads_and_times_change_in_place(compose, peer, wait_for):
    child = compose(BEFORE, CODE, '--watch')
    child.wait_until_ready()
    child.wait_for_line('alone', times=3)
    assert not child.matching('together')

    def count():
        return peer.node.count_publishers('/diagnostics')

    assert not count()

    compose.write(AFTER, CODE)
    assert child.wait_for_line('reloaded in').endswith('~1 system, ~1 process')
    child.wait_for_line('together', times=3)
    messages = peer.listen(DiagnosticArray, '/diagnostics')
    wait_for(count, 'a publisher of diagnostics')

    compose.write(AFTER.replace('period: 900', 'period: 0.1'), CODE)
    wait_for(lambda: len(messages) > 2, 'messages of a shorter period')
    names = {status.name for status in messages[-1].status}
    assert '/one: timer meet' in names

    compose.write(AFTER.replace('{period: 900}', 'false'), CODE)
    wait_for(lambda: not count(), 'the end of the publisher')
    assert not child.matching('not reloaded')

    publisher = peer.advertise(String, '/words')
    publisher.publish(String())
    child.wait_for_line('hanging')
    assert child.stop(signal.SIGINT) == 1
    assert child.matching("process 'deaf' did not end within 0.2 s of SIGINT, and is killed")
    assert child.matching("node 'hanging': subscription 'words' did not end in time")


CLASS = """
class Counter:
    def __init__(self, node):
        self.count = 0

    def tick(self, node):
        self.count += 1
        node.logger.info(f'count {self.count}')

    def show(self, node):
        node.logger.info(f'shown {self.count > 3}')

def other(node):
    node.logger.info('other 1')
"""


def test_an_edit_beside_a_class_leaves_its_instance(compose):
    """Also if the node changes later, and calls another method of the class."""
    text = """
        version: 1
        nodes:
          counter: {timers: {tick: {period: 0.05, behaviour: parts:Counter.tick}}}
          other: {timers: {tick: {period: 0.05, behaviour: parts:other}}}
    """
    more = text.replace(
        'r.tick}}}', 'r.tick}, show: {period: 0.05, behaviour: parts:Counter.show}}}'
    )
    child = compose(text, CLASS, '--watch')
    child.wait_for_line('count 5')
    edited = CLASS.replace('other 1', 'other 2')
    compose.write(text, edited)
    assert child.wait_for_line('reloaded in').endswith(': ~1 timer')
    child.wait_for_line('other 2')
    compose.write(more, edited)
    assert child.wait_for_line('reloaded in', times=2).endswith(': +1 timer')
    child.wait_for_line('shown ')
    assert not child.matching('shown False')
    compose.write(more, edited.replace('> 3', '> 9999'))
    said = "±1 node, ~1 timer; rebuilt: node 'counter' (lost: its state, "
    assert said in child.wait_for_line('reloaded in', times=3)
    child.wait_for_line('shown False')
    assert child.stop() == 0
