"""QoS events as behaviours: called as the node's other callbacks, guarded and edited as these."""

import pytest

pytest.importorskip('rclpy')

from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
nodes:
  talker:
    publishers:
      late:
        type: std_msgs/msg/String
        qos: {deadline: 0.3, liveliness_lease_duration: 1.0}
        on_matched: parts:Ears.matched
        on_deadline_missed: parts:Ears.missed
    timers: {say: {period: 1.0, behaviour: 'parts:say', publish: late}}
  hearer:
    state: {busy: false}
    timers: {work: {period: 0.01, behaviour: 'parts:work'}}
    subscriptions:
      late:
        type: std_msgs/msg/String
        qos: {deadline: 0.4, liveliness_lease_duration: 2.0}
        behaviour: parts:hear
        on_deadline_missed: parts:Ears.missed
        on_liveliness_changed: parts:Ears.live
        on_matched: parts:fail
      rich:
        type: std_msgs/msg/String
        external: true
        behaviour: parts:hear
        on_incompatible_qos: parts:Ears.incompatible
"""
CODE = """\
import time


class Ears:
    def __init__(self, node):
        node.logger.info(f'made {node.name}')

    def matched(self, node, event):
        node.logger.info(f'matched {event.current_count}')

    async def missed(self, node, event):
        node.logger.info(f'missed {event.total_count_change > 0}')

    def incompatible(self, node, event):
        node.logger.info(f'incompatible {event.total_count}')

    def live(self, node, event):
        if node.state.busy:
            node.logger.error('two at once')
        node.logger.info(f'live {event.alive_count}')


def say(node):
    return 'hi'


def work(node):
    node.state.busy = True
    time.sleep(0.005)
    node.state.busy = False


def hear(node, message):
    pass


def fail(node, event):
    raise OSError('no match')
"""


def test_events_call_behaviours(compose, peer):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    for line in (
        '[talker]: matched 1',
        '[talker]: missed True',
        '[hearer]: missed True',
        '[hearer]: live 1',
        "[hearer]: subscription 'late' (on_matched)",
    ):
        child.wait_for_line(line)
    assert child.matching('raised OSError: no match')
    rich = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    peer.run(peer.node.create_publisher, String, '/rich', rich)
    child.wait_for_line('[hearer]: incompatible 1')
    compose.write(SYSTEM.replace('parts:Ears.live', 'parts:fail'), CODE)
    child.wait_for_line('reloaded in')
    assert child.matching('~1 subscription'), child.output
    compose.write(SYSTEM.replace('        on_matched: parts:Ears.matched\n', ''), CODE)
    child.wait_for_line('±1 publisher')
    assert not child.matching('two at once')
    assert child.stop() == 0
