"""Callback groups: what runs beside what."""

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import Int32
from std_srvs.srv import Empty

from composer.runtime.nodes.callback_groups import EventGroup, Gate, GatedReentrantGroup
from composer.runtime.stop_request import StopRequest
from tests.running import wait_for

pytestmark = pytest.mark.ros

# Two behaviours meet at a barrier only if they run at the same time.
CODE = """
import threading
import time

barrier = threading.Barrier(2)

def meet(node):
    try:
        barrier.wait(timeout=0.2)
    except threading.BrokenBarrierError:
        barrier.reset()
        node.logger.info('met nobody')
    else:
        node.logger.info('met')

def alone(node):
    node.state.inside += 1
    time.sleep(0.03)
    node.logger.info(f'inside: {node.state.inside}')
    node.state.inside -= 1

async def alone_async(node):
    alone(node)
"""


MEETING = """
version: 1
executor: {threads: 16}
nodes:
  groups:
    timers:
      one: {period: 0.05, behaviour: 'parts:meet_at', with: {key: groups}}
      two: {period: 0.05, behaviour: 'parts:meet_at', with: {key: groups}, group: other}
  reentrant:
    timers:
      one: {period: 0.05, behaviour: 'parts:meet_at', with: {key: reentrant}, group: reentrant}
      two: {period: 0.05, behaviour: 'parts:meet_at', with: {key: reentrant}, group: reentrant}
  itself:
    timers:
      one: {period: 0.02, behaviour: 'parts:meet_at', with: {key: itself}, group: reentrant}
  strict:
    state: {inside: 0}
    publishers: {ticks: std_msgs/msg/Empty}
    subscriptions: {ticks: {type: std_msgs/msg/Empty, behaviour: 'parts:heard'}}
    timers:
      first: {period: 0.05, behaviour: 'parts:alone'}
      second: {period: 0.05, behaviour: 'parts:alone_async'}
      third: {period: 0.05, publish: ticks, message: {}}
  named:
    timers:
      one: {period: 0.01, behaviour: 'parts:meet', group: shared}
      two: {period: 0.01, behaviour: 'parts:meet', group: shared}
  left: {timers: {one: {period: 0.05, behaviour: 'parts:meet_at', with: {key: nodes}}}}
  right: {timers: {one: {period: 0.05, behaviour: 'parts:meet_at', with: {key: nodes}}}}
"""
MEET_AT = """
def heard(node, message):
    alone(node)

barriers = {key: threading.Barrier(2) for key in ('groups', 'reentrant', 'itself', 'nodes')}

def meet_at(node, key):
    barriers[key].wait(timeout=30)
    node.logger.info('met')
"""


def test_only_behaviours_of_other_nodes_and_of_other_or_reentrant_groups_run_at_once(compose):
    child = compose(MEETING, CODE + MEET_AT)

    for name in ('groups', 'reentrant', 'itself'):
        child.wait_for_line(f'[INFO] [{name}]: met', times=2)
    for name in ('left', 'right'):
        child.wait_for_line(f'[INFO] [{name}]: met')
    child.wait_for_line('inside', times=20)
    child.wait_for_line('[named]: met nobody', times=3)
    # Not those of one group, which is that of the node by default.
    assert set(child.matching('inside')) == {'[INFO] [strict]: inside: 1'}
    assert set(child.matching('[named]')) == {'[INFO] [named]: met nobody'}


def test_from_the_request_to_stop_on_no_behaviour_but_those_of_servers_begins(node):
    stop = StopRequest()
    gate = Gate(stop)
    gate.open()
    timer = node.create_timer(3600.0, print)
    service = node.create_service(Empty, 'served', print)
    assert gate.allows(timer)
    assert gate.allows_events()

    stop.make()
    assert not gate.allows(timer)
    assert not gate.allows_events()
    assert gate.allows(service)
    assert gate.allows_requests()


@pytest.mark.parametrize('group', [GatedReentrantGroup(Gate(StopRequest())), EventGroup()])
def test_a_group_keeps_nothing_of_an_entity_that_is_gone(node, group):
    for _ in range(3):
        service = node.create_service(Empty, 'served', print, callback_group=group)
        publisher = node.create_publisher(Int32, 'sent', 1, callback_group=group)
        assert group.has_entity(service)
        node.destroy_service(service)
        node.destroy_publisher(publisher)
    del service, publisher
    wait_for(lambda: not group.entities, 'the entities to be gone')
