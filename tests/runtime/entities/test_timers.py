"""Timers: what they call, what they publish, and when they end."""

import pytest

pytest.importorskip('rclpy')

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Int32, String

pytestmark = pytest.mark.ros

KINDS = """
version: 1
nodes:
  kinds:
    state: {count: 0, nested: {deep: [1, 2]}}
    publishers:
      counted: {type: std_msgs/msg/Int32, qos: 1000}
      generated: std_msgs/msg/Int32
      awaited: std_msgs/msg/String
      async_generated: std_msgs/msg/Int32
      constant: geometry_msgs/msg/Twist
      silent: std_msgs/msg/Int32
      by_name: std_msgs/msg/String
    timers:
      count: {period: 0.05, behaviour: 'parts:count', publish: counted}
      generate: {rate: 20, behaviour: 'parts:generate', with: {stop: 3}, publish: generated}
      await: {period: 0.05, behaviour: 'parts:await_word', with: {word: hi}, publish: awaited}
      generate_async:
        {period: 0.05, behaviour: 'parts:generate_async', publish: async_generated}
      repeat: {period: 0.05, publish: constant, message: {linear: {x: 1}, angular: {z: 0.5}}}
      nothing: {period: 0.05, behaviour: 'parts:nothing', publish: silent}
      steady: {period: 0.05, clock: steady, behaviour: 'parts:tick', with: {clock: steady}}
      system: {period: 0.05, clock: system, behaviour: 'parts:tick', with: {clock: system}}
      by_name: {period: 0.05, behaviour: 'parts:by_name'}
    on_start: parts:wait_for_peer
  slow:
    timers:
      step: {period: 0.02, behaviour: 'parts:step', group: reentrant}
      step_async: {period: 0.02, behaviour: 'parts:step_async', group: reentrant}
"""

KINDS_CODE = """
import time

from rclpy.task import Future

def count(node):
    node.state.count += 1
    return node.state.count - 1

def generate(node, stop):
    for number in range(stop):
        node.logger.info(f'generating {number}')
        yield number
    node.logger.info('generated all')
    return stop

async def await_word(node, word):
    future = Future()
    future.set_result(word)
    return await future

async def generate_async(node):
    for number in range(2):
        yield {'data': number}
    node.logger.info('generated all asynchronously')

def nothing(node):
    node.logger.debug(f'{node.state.nested}')

def tick(node, *, clock):
    node.logger.info(f'{clock} tick')

def by_name(node):
    node.logger.info(f'ended: {sum(timer.is_canceled() for timer in node.ros.timers)}')
    node.publish('by_name', f'{node.name} {node.state.nested["deep"]}')
    try:
        node.publish('by_nam', 'hello')  # composer: ignore[unknown-publisher]
    except Exception as error:
        node.logger.info(f'{type(error).__name__}: {error}; {error.help}')

def step(node):
    for number in range(4):
        node.logger.info(f'step {number}')
        time.sleep(0.1)
        yield

async def step_async(node):
    for number in range(4):
        node.logger.info(f'async step {number}')
        time.sleep(0.1)
        yield

def wait_for_peer(node):
    # The generators publish a few messages only, so their publishers must know of the peer before.
    while not all(each.get_subscription_count() for each in node.ros.publishers
                  if 'generated' in each.topic_name):
        time.sleep(0.01)
"""


@pytest.fixture(scope='module')
def heard(shared_compose, shared_peer):
    """Return what the timers publish, by topic, from a peer that was there before them."""
    classes = {
        'counted': Int32,
        'generated': Int32,
        'awaited': String,
        'async_generated': Int32,
        'constant': Twist,
        'silent': Int32,
        'by_name': String,
    }
    lists = {topic: shared_peer.listen(kind, topic, 1000) for topic, kind in classes.items()}
    child = shared_compose(KINDS, KINDS_CODE)
    child.wait_until_ready()
    return lists, child


def test_a_function_is_called_each_tick_and_what_it_returns_is_published(heard, wait_for):
    counted = heard[0]['counted']
    wait_for(lambda: len(counted) >= 3, 'three messages')

    first = counted[0].data
    assert [message.data for message in counted[:3]] == [first, first + 1, first + 2]


def test_a_generator_is_resumed_each_tick_and_ends_its_timer_when_it_returns(heard, wait_for):
    messages, child = heard
    child.wait_for_line('[INFO] [kinds]: generated all')
    # Another timer has ticked often since then.
    ticks = len(child.matching('steady tick'))
    child.wait_for_line('steady tick', times=ticks + 5)

    wait_for(lambda: len(messages['generated']) >= 4, 'all that it yields and returns')
    assert [message.data for message in messages['generated']] == [0, 1, 2, 3]
    assert len(child.matching('generating 0')) == 1
    assert len([line for line in child.lines if line.endswith('generated all')]) == 1
    child.wait_for_line('ended: 2')


def test_an_async_function_is_awaited(heard, wait_for):
    assert wait_for(lambda: heard[0]['awaited'], 'a message')[0].data == 'hi'


def test_an_async_generator_is_resumed_each_tick_and_ends_its_timer(heard, wait_for):
    messages, child = heard
    child.wait_for_line('generated all asynchronously')
    ticks = len(child.matching('steady tick'))
    child.wait_for_line('steady tick', times=ticks + 5)

    wait_for(lambda: len(messages['async_generated']) >= 2, 'all that it yields')
    assert [message.data for message in messages['async_generated']] == [0, 1]


def test_a_constant_is_published_without_a_behaviour(heard, wait_for):
    expected = Twist()
    expected.linear.x = 1.0
    expected.angular.z = 0.5

    assert wait_for(lambda: heard[0]['constant'], 'a message')[0] == expected


def test_none_publishes_nothing(heard, wait_for):
    messages, _ = heard
    before = len(messages['counted'])
    wait_for(lambda: len(messages['counted']) > before + 3, 'more ticks of another timer')

    assert messages['silent'] == []


def test_a_timer_ticks_by_the_clock_that_it_names(heard):
    for clock in ('steady', 'system'):
        heard[1].wait_for_line(f'{clock} tick', times=3)


def test_publish_by_name_reaches_what_is_declared_and_names_what_is_near(heard, wait_for):
    messages, child = heard

    assert wait_for(lambda: messages['by_name'], 'a message')[0].data == 'kinds [1, 2]'
    child.wait_for_line(
        "[INFO] [kinds]: UndeclaredError: node 'kinds' declares no publisher 'by_nam'; "
        "did you mean 'by_name'?"
    )


def test_simulated_time_drives_ros_timers_and_no_others(compose, peer, wait_for):
    text = """
        version: 1
        nodes:
          simulated:
            use_sim_time: true
            timers:
              by_ros: {period: 10.0, behaviour: 'parts:tell', with: {clock: ros}}
              by_steady: {period: 0.05, clock: steady, behaviour: 'parts:tell', with: {clock: steady}}
    """
    code = """
        def tell(node, clock):
            node.logger.info(f'{clock} at {node.now().nanoseconds // 1_000_000_000}')
    """
    child = compose(text, code)
    child.wait_until_ready()
    clock = peer.advertise(Clock, '/clock')
    child.wait_for_line('steady at 0')
    assert not child.matching('ros at')

    def set_time(seconds, line):
        # The clock is heard without any guarantee of delivery.
        clock.publish(Clock(clock=Time(sec=seconds)))
        return child.matching(line)

    wait_for(lambda: set_time(100, 'steady at 100'), 'a tick at 100 s')
    assert not child.matching('ros at 111')
    wait_for(lambda: set_time(111, 'ros at 111'), 'a tick of simulated time')
    assert child.stop() == 0


def test_a_generator_never_overlaps_itself_even_in_a_reentrant_group(heard):
    _, child = heard
    child.wait_for_line(']: step 3')
    child.wait_for_line(']: async step 3')
    assert not child.matching('raised')
    for kind in ('step', 'async step'):
        steps = [line for line in child.lines if f']: {kind} ' in line]
        assert steps == [f'[INFO] [slow]: {kind} {number}' for number in range(4)]
