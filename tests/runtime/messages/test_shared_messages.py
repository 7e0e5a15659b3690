"""Subscriptions that only read share a message, whose arrays nobody can write to."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
defaults: {{local_delivery: {local}}}
nodes:
  source:
    publishers: {{pose: &pose {{topic: pose, type: geometry_msgs/msg/PoseWithCovariance}}}}
    timers: {{tick: {{period: 0.05, behaviour: 'parts:send', publish: pose}}}}
  readers:
    state: {{ids: {{}}}}
    subscriptions:
      first: {{<<: *pose, behaviour: 'parts:read', with: {{who: first}}, read_only: true}}
      second: {{<<: *pose, behaviour: 'parts:read_later', with: {{who: second}}, read_only: true}}
  writer:
    subscriptions:
      own: {{<<: *pose, behaviour: 'parts:write'}}
"""

CODE = """
from geometry_msgs.msg import PoseWithCovariance

def send(node):
    return PoseWithCovariance()

def read(node, message, who):
    node.state.ids.setdefault(who, []).append(message)
    shared = {id(each) for each in node.state.ids.get('first', ())} & {
        id(each) for each in node.state.ids.get('second', ())}
    try:
        message.covariance[0] = 1.0  # composer: ignore[read-only-message]
    except ValueError:
        node.logger.info(f'{who} may not write, {message.covariance[0]}, shared: {bool(shared)}')

async def read_later(node, message, who):
    read(node, message, who)

def write(node, message):
    message.covariance[0] += 1.0
    node.logger.info(f'own {message.covariance[0]}')
"""


@pytest.mark.parametrize('local', ['true', 'false'])
def test_those_that_read_share_a_message_that_the_others_do_not_see(compose, local):
    child = compose(SYSTEM.format(local=local), CODE)
    for who in ('first', 'second'):
        child.wait_for_line(f'{who} may not write, 0.0, shared: {local.capitalize()}')
    child.wait_for_line('own 1.0')
    assert 'own 2.0' not in child.output
