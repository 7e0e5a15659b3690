"""`/diagnostics`, as a plain rclpy node hears it from a running system."""

from itertools import pairwise
from statistics import median

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Empty, Int32
from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros

BEHAVIOURS = """
import threading

may_go = threading.Event()

def hear(node, message):
    if message.data < 0:
        raise ValueError(f'{message.data} is negative')

def stick(node, message):
    node.logger.info(f'got {message.data}')
    if message.data == 0:
        may_go.wait(60.0)

def go(node, message):
    may_go.set()

def tick(node):
    pass

"""

SYSTEM = """
version: 1
diagnostics: {period: 0.2}
nodes:
  ear:
    namespace: robot
    subscriptions:
      numbers: {type: std_msgs/msg/Int32, topic: /numbers, behaviour: parts:hear}
  sticky:
    subscriptions:
      slow: {type: std_msgs/msg/Int32, behaviour: parts:stick, qos: 10}
      release: {type: std_msgs/msg/Empty, behaviour: parts:go, group: other}
    timers:
      tick: {rate: 50, behaviour: parts:tick}
"""


COSTS = {'cores', 'cpu (%)', 'GIL wait mean (ms)', 'GIL wait max (ms)'}


class Listener:
    """What was heard of each entity."""

    def __init__(self, peer):
        self.messages = peer.listen(DiagnosticArray, '/diagnostics', 100)

    def statuses(self, name):
        return [s for m in list(self.messages) for s in m.status if s.name == name]

    def values(self, name):
        statuses = self.statuses(name)
        return {pair.key: pair.value for pair in statuses[-1].values} if statuses else {}


@pytest.fixture
def listener(peer):
    return Listener(peer)


def test_a_behaviour_that_hangs_is_told_of_with_all_that_it_holds_up(
    compose, peer, listener, wait_for
):
    child = compose(SYSTEM, BEHAVIOURS)
    child.wait_until_ready()
    publisher = peer.advertise(Int32, '/slow', 200)
    slow, tick = '/sticky: subscription slow', '/sticky: timer tick'
    wait_for(lambda: listener.values(tick).get('calls', '0') != '0', 'a tick')
    publisher.publish(Int32(data=0))
    child.wait_for_line('got 0')
    for number in range(1, 101):
        publisher.publish(Int32(data=number))
    wait_for(
        lambda: 'a call has been running for' in listener.statuses(slow)[-1].message,
        'what hangs',
    )
    status = listener.statuses(slow)[-1]
    assert status.level == DiagnosticStatus.WARN
    assert listener.values(slow)['calls'] == '0'
    wait_for(lambda: listener.values(slow)['queue overruns'] == '90', 'all that is dropped')
    peer.advertise(Empty, '/release').publish(Empty())
    wait_for(lambda: listener.values(slow)['calls'] == '11', 'those that were kept')
    assert listener.values(slow)['queue overruns'] == '90'
    wait_for(lambda: int(listener.values(tick)['skipped ticks']) >= 50, 'skipped ticks')
    assert int(listener.values(tick)['late ticks']) >= 1
    wait_for(
        lambda: any(
            s.level == DiagnosticStatus.WARN and 'skipped tick' in s.message
            for s in listener.statuses(tick)
        ),
        'the warning',
    )
    assert child.stop() == 0


def test_it_can_be_turned_off(compose, peer, wait_for):
    child = compose(SYSTEM.replace('{period: 0.2}', 'false'), BEHAVIOURS, '--no-control')
    child.wait_until_ready()
    wait_for(lambda: peer.node.count_publishers('/numbers') == 0 and seen(peer, 'sticky'), 'it')
    peer.advertise(Int32, '/numbers').publish(Int32(data=-1))
    child.wait_for_line('-1 is negative')
    assert peer.node.count_publishers('/diagnostics') == 0
    assert not seen(peer, '_composer_system')
    assert child.stop() == 0


def seen(peer, name):
    return name in peer.node.get_node_names()


def test_it_comes_as_often_as_declared_from_a_hidden_node_with_nothing_but_the_topic(
    compose, peer, listener, wait_for
):
    text = SYSTEM.replace('{period: 0.2}', '{period: 0.1}')
    child = compose(text, BEHAVIOURS, '--no-control')
    child.wait_until_ready()

    def median_sec():
        headers = [message.header.stamp for message in list(listener.messages)]
        stamps = [stamp.sec + stamp.nanosec / 1e9 for stamp in headers]
        return median([later - earlier for earlier, later in pairwise(stamps)])

    # The machine may delay messages: some come late, and the ones after them early.
    wait_for(lambda: len(listener.messages) > 5, 'six messages')
    wait_for(lambda: 0.8 < median_sec() / 0.1 < 1.25, 'as many as are declared')
    wait_for(lambda: seen(peer, '_composer_system'), 'the node')
    wait_for(lambda: listener.messages, 'a message')

    def publishers():
        return [e.node_name for e in peer.node.get_publishers_info_by_topic('/diagnostics')]

    # An end may be found before the name of its node.
    wait_for(lambda: publishers() == ['_composer_system'], 'its publisher')
    assert peer.node.get_service_names_and_types_by_node('_composer_system', '/') == []
    assert child.stop() == 0


def check_that_calls_and_errors_are_counted(peer, listener, wait_for):
    publisher = peer.advertise(Int32, '/numbers')
    wait_for(lambda: listener.messages, 'a message, after which none is missed')
    name = '/robot/ear: subscription numbers'
    for number in (1, 2, -3, 4, -5):
        publisher.publish(Int32(data=number))
    wait_for(lambda: listener.values(name).get('calls') == '5', 'five calls')
    assert listener.values(name)['errors'] == '2'
    wait_for(
        lambda: any(
            s.level == DiagnosticStatus.ERROR
            and s.message.endswith('last: ValueError: -5 is negative')
            for s in listener.statuses(name)
        ),
        'the errors',
    )
    wait_for(lambda: listener.statuses(name)[-1].level == DiagnosticStatus.OK, 'its recovery')
    assert {s.hardware_id for s in listener.statuses(name)} == {'system'}
    # Who listens hears what calls cost.
    tick, system = '/sticky: timer tick', '/_composer_system: system'
    wait_for(lambda: float(listener.values(tick).get('cpu (%)') or 0), 'the share of a processor')
    wait_for(lambda: listener.values(system).get('GIL wait max (ms)'), 'waits')
    assert int(listener.values(system)['cores']) >= 1


def test_entities_and_the_system_have_a_status(compose, peer, listener, wait_for):
    child = compose(SYSTEM, BEHAVIOURS)
    child.wait_until_ready()
    check_that_calls_and_errors_are_counted(peer, listener, wait_for)
    name = '/_composer_system: system'
    wait_for(lambda: listener.values(name).get('state') == 'running', 'its state')
    path = compose.folder / 'system.yaml'
    wait_for(lambda: listener.values(name).keys() >= COSTS, 'what it costs')
    known = listener.values(name) | {'uptime (s)': '', 'host': '', **dict.fromkeys(COSTS, '')}
    assert known == {
        **dict.fromkeys(COSTS, ''),
        'name': 'system',
        'file': str(path),
        'host': '',
        'pid': str(child.pid),
        'state': 'running',
        'uptime (s)': '',
        'last reload': '',
        'last error': '',
    }
    assert listener.statuses(name)[-1].level == DiagnosticStatus.OK
    path.write_text(path.read_text().replace('rate: 50', 'rate: none'))
    answer = peer.call(Trigger, '/_composer_system/reload')
    assert not answer.success
    assert 'error[' in answer.message
    wait_for(lambda: 'system.yaml:' in listener.values(name)['last error'], 'the error')
    assert listener.statuses(name)[-1].level == DiagnosticStatus.WARN
    path.write_text(path.read_text().replace('rate: none', 'rate: 51'))
    assert peer.call(Trigger, '/_composer_system/reload').success
    wait_for(lambda: listener.values(name)['last error'] == '', 'its end')
    assert 'reloaded in' in listener.values(name)['last reload']
    assert child.stop() == 0
