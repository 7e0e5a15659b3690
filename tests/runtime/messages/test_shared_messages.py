"""Subscriptions that only read share a message, whose arrays nobody can write to."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  source:
    publishers: {info: &info {topic: info, type: sensor_msgs/msg/CameraInfo}}
    timers: {tick: {period: 0.05, behaviour: 'parts:send', publish: info}}
  readers:
    state: {ids: {}}
    subscriptions:
      first: {<<: *info, behaviour: 'parts:read', with: {who: first}, read_only: true}
      second: {<<: *info, behaviour: 'parts:read_later', with: {who: second}, read_only: true}
  writer:
    subscriptions:
      own: {<<: *info, behaviour: 'parts:write'}
"""

CODE = """
from sensor_msgs.msg import CameraInfo

def send(node):
    return CameraInfo(d=[0.0])

def read(node, message, who):
    node.state.ids.setdefault(who, []).append(message)
    shared = {id(each) for each in node.state.ids.get('first', ())} & {
        id(each) for each in node.state.ids.get('second', ())}
    refused = 0
    for values in (message.k, message.d):
        try:
            values[0] = 1.0  # composer: ignore[read-only-message]
        except (ValueError, TypeError):
            refused += 1
    found = message.k[0] + message.d[0]
    node.logger.info(f'{who} may not write {refused} arrays, {found}, shared: {bool(shared)}')

async def read_later(node, message, who):
    read(node, message, who)

def write(node, message):
    message.k[0] += 1.0
    message.d[0] += 1.0
    node.logger.info(f'own {message.k[0] + message.d[0]}')
"""


def test_those_that_read_share_a_message_that_the_others_do_not_see(compose):
    child = compose(SYSTEM, CODE)
    for who in ('first', 'second'):
        child.wait_for_line(f'{who} may not write 2 arrays, 0.0, shared: True')
    child.wait_for_line('own 2.0', times=3)
    assert not [each for each in child.matching('own ') if 'own 2.0' not in each]
