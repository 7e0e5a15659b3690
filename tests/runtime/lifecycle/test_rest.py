"""What a node with a lifecycle does not do while it is not active, and what comes meanwhile."""

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros

CODE = """
import time
from composer import CallError

def tick(node):
    node.logger.info('tick')
    return 'tick'

def note(node):
    node.logger.info('noted')

def count(node):
    number = 0
    try:
        while True:
            number += 1
            node.logger.info(f'count {number}')
            yield
    finally:
        node.logger.info(f'counted to {number}')

def hear(node, message, what='heard'):
    node.logger.info(f'{what} {message.data}')

def create(node):
    node.create_timer(0.02, tick)
    node.create_subscription('std_msgs/msg/String', 'shouts', hear)

def answer(node, request):
    return {'success': True}

def compute(node, goal):
    node.logger.info('goal begins')
    while True:
        time.sleep(0.01)
        yield

def say(node, text):
    node.publish('words', text)

def send(node):
    for number in range(3):
        node.publish('words', f'{number} of {node.state.round}')
    node.logger.info(f'has sent round {node.state.round}')
    node.state.round += 1
    try:
        node.call('ask', timeout=30)
    except CallError as error:
        node.logger.info(f'{type(error).__name__}: {error}')
    else:
        node.logger.info('answered')
    yield
"""
CONFIGURE, ACTIVATE, DEACTIVATE = (
    Transition.TRANSITION_CONFIGURE,
    Transition.TRANSITION_ACTIVATE,
    Transition.TRANSITION_DEACTIVATE,
)


def test_timers_and_publishers_rest_until_active(compose, peer, wait_for):
    text = """
        version: 1
        nodes:
          robot:
            lifecycle: true
            publishers: {words: {type: std_msgs/msg/String, external: true}}
            timers:
              tick: {period: 0.02, behaviour: 'parts:tick', publish: words}
              count: {period: 0.02, behaviour: 'parts:count'}
            on_configure: {behaviour: 'parts:say', with: {text: configured}}
            on_activate: {behaviour: 'parts:say', with: {text: activated}}
            on_deactivate: {behaviour: 'parts:say', with: {text: deactivated}}
          maker: {lifecycle: true, on_configure: parts:create}
          other:
            publishers: {shouts: {type: std_msgs/msg/String, external: true}}
            timers: {tick: {period: 0.02, behaviour: 'parts:tick', publish: shouts}}
    """
    child = compose(text, CODE)
    child.wait_until_ready()
    heard = peer.listen(String, 'words')
    wait_for(lambda: peer.node.count_publishers('words'), 'the publisher')
    for node in ('robot', 'maker'):
        peer.change_state(node, CONFIGURE)
    child.wait_for_line("publisher 'words' drops what is published: the node is configuring")
    child.wait_for_line('[other]: tick', times=len(child.matching('[other]: tick')) + 5)
    assert not child.matching('[robot]: tick')
    # What a transition creates rests, too.
    assert not child.matching('[maker]: tick')
    assert not child.matching('[maker]: heard')
    for node in ('robot', 'maker'):
        peer.change_state(node, ACTIVATE)
    child.wait_for_line('[robot]: tick', times=5)
    child.wait_for_line('[maker]: tick', times=3)
    child.wait_for_line('[maker]: heard tick', times=3)
    child.wait_for_line('[robot]: count 3')
    peer.change_state('robot', DEACTIVATE)
    wait_for(lambda: heard and heard[-1].data == 'deactivated', 'the last message')
    child.wait_for_line('[robot]: counted to')
    ticks = len(child.matching('[robot]: tick'))
    child.wait_for_line('[other]: tick', times=len(child.matching('[other]: tick')) + 5)
    assert len(child.matching('[robot]: tick')) == ticks
    # What ended begins anew.
    peer.change_state('robot', ACTIVATE)
    child.wait_for_line('[robot]: count 1', times=len(child.matching('[robot]: count 1')) + 1)
    assert {message.data for message in heard} == {'activated', 'tick', 'deactivated'}
    assert heard[0].data == 'activated'
    assert child.stop() == 0


LISTENING = """
version: 1
defaults: {local_delivery: %s}
nodes:
  robot:
    lifecycle: true
    subscriptions:
      dropped: {topic: words, type: std_msgs/msg/String, behaviour: 'parts:hear', with: {what: dropped}}
      kept:
        topic: words
        type: std_msgs/msg/String
        qos: 2
        behaviour: 'parts:hear'
        with: {what: kept}
        while_inactive: keep
        group: other
    services:
      ask: {type: std_srvs/srv/Trigger, behaviour: 'parts:answer'%s}
  client:
    state: {round: 1}
    publishers: {words: std_msgs/msg/String}
    service_clients: {ask: std_srvs/srv/Trigger}
    services:
      go: {type: std_srvs/srv/Trigger, behaviour: 'parts:go', group: reentrant}
"""
GO = """

def go(node, request):
    list(send(node))
    return {'success': True}
"""


@pytest.mark.parametrize('local', ['true', 'false'])
def test_what_comes_meanwhile_is_dropped_or_kept(compose, peer, wait_for, local):
    child = compose(LISTENING % (local, ', while_inactive: keep'), CODE + GO)
    child.wait_until_ready()
    client = peer.run(peer.node.create_client, Trigger, 'go')
    assert client.wait_for_service(20.0)
    pending = client.call_async(Trigger.Request())
    child.wait_for_line('has sent round 1')
    peer.change_state('robot', CONFIGURE)
    assert not child.matching('[robot]: dropped')
    assert not child.matching('[robot]: kept')
    assert not pending.done()
    peer.change_state('robot', ACTIVATE)
    wait_for(pending.done, 'the answer that was kept')
    child.wait_for_line('[robot]: kept 2 of 1')
    peer.call(Trigger, 'go')
    child.wait_for_line('[robot]: dropped 2 of 2')
    child.wait_for_line('[robot]: kept 2 of 2')
    assert [line.partition('dropped ')[2] for line in child.matching('[robot]: dropped')] == [
        f'{number} of 2' for number in range(3)
    ]
    # As many as the queue holds.
    kept = [line.partition('kept ')[2] for line in child.matching('[robot]: kept')]
    assert kept[:2] == ['1 of 1', '2 of 1']
    assert child.stop() == 0


def test_requests_are_refused_by_default(compose, peer):
    child = compose(LISTENING % ('true', ''), CODE + GO)
    child.wait_until_ready()
    peer.call(Trigger, 'go')
    child.wait_for_line(
        "[client]: ServiceNotAvailableError: '/ask' answers no requests: "
        "node 'robot' is unconfigured"
    )
    client = peer.run(peer.node.create_client, Trigger, 'ask')
    assert client.wait_for_service(20.0)
    unanswered = client.call_async(Trigger.Request())
    child.wait_for_line("service 'ask' answers no requests: the node is unconfigured")
    peer.change_state('robot', CONFIGURE, ACTIVATE)
    assert peer.call(Trigger, 'ask').success
    assert not unanswered.done()
    assert child.stop() == 0


def test_goals_are_rejected_those_in_flight_end_and_a_latched_message_is_kept(
    compose, peer, wait_for
):
    from action_msgs.msg import GoalStatus
    from rclpy.action import ActionClient

    test_msgs = pytest.importorskip('test_msgs.action')
    text = """
        version: 1
        nodes:
          robot:
            lifecycle: {start: inactive}
            actions: {count: {type: test_msgs/action/Fibonacci, behaviour: 'parts:compute'}}
            subscriptions:
              map:
                type: std_msgs/msg/String
                qos: {depth: 1, durability: transient_local}
                behaviour: parts:hear
                external: true
            on_deactivate: parts:note
    """
    child = compose(text, CODE)
    child.wait_until_ready()
    client = peer.run(ActionClient, peer.node, test_msgs.Fibonacci, 'count')
    assert client.wait_for_server(20.0)
    peer.meet_action_server('count')

    def send():
        sent = client.send_goal_async(test_msgs.Fibonacci.Goal())
        wait_for(sent.done, 'the answer')
        return sent.result()

    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    peer.advertise(String, 'map', qos).publish(String(data='of the house'))
    assert not send().accepted
    assert not child.matching('heard')
    peer.change_state('robot', ACTIVATE)
    child.wait_for_line('heard of the house')
    goal = send()
    assert goal.accepted
    result = goal.get_result_async()
    child.wait_for_line('goal begins')
    peer.change_state('robot', DEACTIVATE)
    wait_for(result.done, 'the result')
    assert result.result().status == GoalStatus.STATUS_ABORTED
    child.wait_for_line('[robot]: noted')
    peer.run(client.destroy)
    assert child.stop() == 0
