"""Behaviours that raise: what is said, and what is done about it."""

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int32, String

pytestmark = pytest.mark.ros

CODE = """
def fail(node):
    raise RuntimeError('out of order')

def live(node):
    node.logger.info('alive')

def hear(node, message):
    node.logger.info(f'heard {message.data}')
    return 1 // message.data

"""


def test_an_error_is_logged_with_node_entity_place_and_traceback_and_others_go_on(
    compose, peer, wait_for
):
    # What the entity says wins over what the node and the file say.
    text = """
        version: 1
        defaults: {on_error: shutdown}
        nodes:
          bad:
            namespace: deep
            timers:
              fail: {period: 0.02, behaviour: 'parts:fail', on_error: log}
              live: {period: 0.02, behaviour: 'parts:live'}
          tolerant:
            on_error: log
            timers: {fail: {period: 0.02, behaviour: 'parts:fail'}}
          good:
            timers:
              live: {period: 0.02, behaviour: 'parts:live'}
    """
    # The lines of the others may come in front of it, all at once.
    latched = QoSProfile(depth=10_000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    heard = peer.listen(Log, '/rosout', latched)
    child = compose(text, CODE)
    first = child.wait_for_line('[ERROR] [deep.bad]')
    child.wait_for_line('[ERROR] [tolerant]')
    child.wait_for_line('RuntimeError: out of order', times=4)
    alive = [len(child.matching(f'[{node}]: alive')) for node in ('deep.bad', 'good')]
    child.wait_for_line('[deep.bad]: alive', times=alive[0] + 3)
    child.wait_for_line('[good]: alive', times=alive[1] + 3)
    error = wait_for(
        lambda: [log for log in heard if 'Traceback' in log.msg and log.name == 'deep.bad'],
        'the error on /rosout',
    )[0]
    assert child.stop() == 0

    said = "timer 'fail' (system.yaml:8) raised RuntimeError: out of order"
    assert first == f'[ERROR] [deep.bad]: {said}'
    begin = child.lines.index(first)
    lines = [line for line in child.lines[begin + 1 :] if line.startswith('  ')]
    assert lines[:4] == [
        '  Traceback (most recent call last):',
        f'    File "{compose.folder}/parts.py", line 3, in fail',
        "      raise RuntimeError('out of order')",
        '  RuntimeError: out of order',
    ]
    assert error.level == Log.ERROR
    assert error.msg.startswith(f'{said}\n')


def test_a_subscription_that_raised_hears_the_next_message(compose, peer):
    text = """
        version: 1
        nodes:
          ears: {subscriptions: {number: {type: std_msgs/msg/Int32, behaviour: 'parts:hear'}}}
    """
    child = compose(text, CODE)
    publisher = peer.advertise(Int32, 'number')
    publisher.publish(Int32(data=0))
    child.wait_for_line(
        "[ERROR] [ears]: subscription 'number' (system.yaml:4) raised ZeroDivisionError: "
    )
    publisher.publish(Int32(data=7))

    child.wait_for_line('[INFO] [ears]: heard 7')


def test_on_error_shutdown_stops_the_system_with_exit_code_1(compose):
    text = """
        version: 1
        nodes:
          bad:
            on_error: shutdown
            timers: {fail: {period: 0.05, behaviour: 'parts:fail'}}
          good:
            on_stop: parts:live
    """
    child = compose(text, CODE)

    assert child.wait() == 1
    child.wait_for_line("[bad]: timer 'fail' (system.yaml:6) raised RuntimeError: out of order")
    child.wait_for_line('[good]: alive')


RESTARTING = """
version: 1
nodes:
  phoenix:
    on_error: restart
    parameters: {mode: calm}
    state: {ticks: 0, all: []}
    publishers: {ticks: std_msgs/msg/Int32}
    subscriptions:
      number: {type: std_msgs/msg/Int32, behaviour: 'parts:hear'}
    timers: {tick: {period: 0.02, behaviour: 'parts:tick', publish: ticks}}
    on_start: parts:start
    on_stop: parts:stop
  bystander:
    timers: {live: {period: 0.05, behaviour: 'parts:live'}}
"""

RESTARTING_CODE = (
    CODE
    + """
from pathlib import Path
from rclpy.parameter import Parameter

def start(node):
    node.logger.info(f'start: {node.parameters.mode}, {node.state.ticks} ticks, {node.state.all}')
    if Path('no_start').exists():
        raise OSError('no such device')

def stop(node):
    node.logger.info('stop')

def tick(node):
    node.state.ticks += 1
    getattr(node.state, 'all', []).append(node.state.ticks)
    if node.state.ticks == 3 and not Path('calm').exists():
        node.ros.set_parameters([Parameter('mode', value='wild')])
        raise RuntimeError('out of order')
    return node.state.ticks
"""
)


def test_on_error_restart_rebuilds_the_node_until_it_starts(compose, peer, wait_for):
    ticks = peer.listen(Int32, 'ticks')
    child = compose(RESTARTING, RESTARTING_CODE)
    child.wait_for_line("[WARN] [composer]: node 'phoenix' was restarted", times=3)
    assert len(child.matching(']: stop')) >= 3
    (compose.folder / 'no_start').touch()
    child.wait_for_line("[ERROR] [composer]: restart: node 'phoenix': on_start raised", times=2)
    alive = len(child.matching('[bystander]: alive'))
    child.wait_for_line('[bystander]: alive', times=alive + 3)
    (compose.folder / 'calm').touch()
    (compose.folder / 'no_start').unlink()
    wait_for(lambda: ticks and ticks[-1].data > 5, 'ticks after the last restart')
    numbers = peer.advertise(Int32, 'number')

    def is_heard():
        # At first it may have met the subscription of before the restart alone.
        numbers.publish(Int32(data=5))
        return child.matching('[INFO] [phoenix]: heard 5')

    wait_for(is_heard, 'a message to be heard')
    wait_for(lambda: peer.node.get_node_names().count('phoenix') == 1, 'one such node')
    assert child.stop() == 0

    assert set(child.matching('[phoenix]: start: ')) == {
        '[INFO] [phoenix]: start: calm, 0 ticks, []'
    }
    assert not child.matching('InvalidHandle')


def test_a_message_cannot_write_lines_or_escape_codes_into_the_log(compose, peer):
    text = """
        version: 1
        nodes:
          ears: {subscriptions: {words: {type: std_msgs/msg/String, behaviour: 'parts:hear'}}}
    """
    code = """
        def hear(node, message):
            raise ValueError(message.data)
    """
    child = compose(text, code)
    forged = '\n[FATAL] [composer]: forged\x1b[2J\x9b2J\u2028\u202e\r\x7f'
    peer.advertise(String, 'words').publish(String(data=forged))
    child.wait_for_line('ValueError', times=2)

    assert child.stop() == 0
    assert not [line for line in child.lines if line.startswith('[FATAL]')]
    assert all(line.isprintable() for line in child.lines)
    escaped = r'[FATAL] [composer]: forged\x1b[2J\x9b2J\u2028\u202e\r\x7f'
    assert child.lines.count(f'  {escaped}') == 2
