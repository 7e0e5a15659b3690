"""`wait_for`: nodes and processes start in the order that they ask for, without any sleep."""

import sys
import threading
from itertools import count
from math import inf
from textwrap import dedent
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import String
from std_srvs.srv import Trigger

import composer.runtime.wait_for as wait_for_module
from composer.language.specs import ConditionSpec
from composer.runtime.stop_request import StopRequest
from composer.runtime.wait_for import Waiter, WaitingStarter
from tests.running import DEADLINE_SEC

pytestmark = pytest.mark.ros

CODE = """
import time

def tell(node, text):
    node.logger.info(text)

def answer(node, request):
    return {'success': True}

def compute(node, goal):
    return {'sequence': []}

def fail(node):
    raise OSError('no such device')

def meet_peer(node):
    while 'peer' not in node.ros.get_node_names():
        time.sleep(0.01)

def find_scan(node):
    while not node.ros.count_publishers('/scan'):
        time.sleep(0.01)
"""
WAITING = "on_start: {behaviour: 'parts:tell', with: {text: starts}}"


def test_a_node_starts_when_somebody_publishes_the_topic(compose, peer, wait_for):
    text = f"""
        version: 1
        nodes:
          late:
            namespace: robot
            wait_for: {{topic: words}}
            subscriptions: {{words: {{type: std_msgs/msg/String, behaviour: 'parts:hear', external: true}}}}
            {WAITING}
          free: {{timers: {{t: {{period: 0.02, behaviour: 'parts:tell', with: {{text: tick}}}}}}}}
    """
    code = CODE + '\ndef hear(node, message):\n    node.logger.info(message.data)\n'
    child = compose(text, code)
    child.wait_for_line('[free]: tick', times=5)
    wait_for(lambda: peer.node.count_subscribers('/robot/words'), 'the subscription')
    assert not child.matching('starts')
    assert not child.matching(' ready in ')

    publisher = peer.advertise(String, '/robot/words')
    child.wait_until_ready()
    assert child.lines.index('[INFO] [robot.late]: starts') < child.lines.index(
        child.matching('system: 2 nodes ready in ')[0]
    )
    publisher.publish(String(data='heard at last'))
    child.wait_for_line('[robot.late]: heard at last')
    assert child.stop() == 0


def test_what_belongs_to_a_node_that_has_not_started_is_not_there(compose, peer):
    pytest.importorskip('test_msgs')
    text = f"""
        version: 1
        nodes:
          fifth: {{wait_for: [{{action: count, timeout: 40}}, {{node: fourth}}], {WAITING}}}
          fourth:
            wait_for: {{node: /third}}
            actions: {{count: {{type: test_msgs/action/Fibonacci, behaviour: 'parts:compute'}}}}
            {WAITING}
          third:
            wait_for: {{service: ask}}
            {WAITING}
          second:
            wait_for: {{topic: words}}
            services: {{ask: {{type: std_srvs/srv/Trigger, behaviour: 'parts:answer'}}}}
            {WAITING}
          first:
            wait_for: {{service: go}}
            publishers: {{words: {{type: std_msgs/msg/String, external: true}}}}
            {WAITING}
    """
    child = compose(text, CODE)
    heard = peer.listen(String, '/words')
    peer.run(peer.node.create_service, Trigger, 'go', lambda _request, response: response)
    child.wait_until_ready()

    names = ['first', 'second', 'third', 'fourth', 'fifth']
    assert child.matching('starts') == [f'[INFO] [{name}]: starts' for name in names]
    assert child.stop() == 0
    assert heard == []


def test_a_node_answers_nobody_before_it_starts(compose, peer):
    text = """
        version: 1
        nodes:
          late:
            wait_for: {topic: words}
            services: {ask: {type: std_srvs/srv/Trigger, behaviour: 'parts:answer'}}
          free: {timers: {t: {period: 0.02, behaviour: 'parts:tell', with: {text: tick}}}}
    """
    code = CODE.replace("return {'success'", "node.logger.info('asked')\n    return {'success'")
    child = compose(text, code)
    client = peer.run(peer.node.create_client, Trigger, 'ask')
    assert client.wait_for_service(DEADLINE_SEC)
    client.call_async(Trigger.Request())
    child.wait_for_line('tick', times=len(child.matching('tick')) + 20)
    assert not child.matching('asked')

    peer.run(peer.node.create_publisher, String, 'words', 1)
    child.wait_until_ready()
    assert peer.call(Trigger, 'ask').success


def test_a_client_of_a_service_is_no_server(compose, peer, wait_for):
    text = f"""
        version: 1
        nodes:
          user:
            wait_for: {{service: ask, timeout: 1}}
            service_clients: {{ask: {{type: std_srvs/srv/Trigger, external: true}}}}
            {WAITING}
    """
    peer.run(peer.node.create_client, Trigger, 'ask')
    child = compose(text, CODE)

    assert child.wait() == 1
    assert child.lines[-2:] == [
        "error: node 'user' (system.yaml:5) waited 1 s for the service '/ask': nothing serves it",
        '  help: there are no services except those of every node',
    ]


def test_names_are_those_that_the_node_would_use(compose, peer):
    text = f"""
        version: 1
        nodes:
          user:
            namespace: robot
            remap: {{words: /far/words}}
            wait_for: [{{topic: words, timeout: 30}}, {{topic: ~/own, timeout: 30}}]
            {WAITING}
    """
    peer.run(peer.node.create_publisher, String, '/far/words', 1)
    peer.run(peer.node.create_publisher, String, '/robot/user/own', 1)
    child = compose(text, CODE)

    child.wait_until_ready()


DRIVER = """
import sys, rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node('driver')
print('on its way', flush=True)
node.create_publisher(String, 'scan', 1)
rclpy.spin(node)
"""


def test_nodes_and_processes_wait_for_each_other(compose):
    (compose.folder / 'driver.py').write_text(DRIVER)
    python = sys.executable
    text = f"""
        version: 1
        nodes:
          filter:
            wait_for: {{topic: scan}}
            publishers: {{filtered: {{type: std_msgs/msg/String, external: true}}}}
            {WAITING}
          last: {{wait_for: [{{process: recorder}}, {{node: driver}}], {WAITING}}}
        processes:
          recorder: {{command: [sh, -c, 'echo records; exec sleep 3600'], wait_for: {{topic: filtered}}}}
          driver: {{command: ['{python}', driver.py], wait_for: {{process: setup}}}}
          setup: {{command: ['true']}}
    """
    child = compose(text, CODE)
    child.wait_until_ready()
    child.wait_for_line('[recorder] records')

    lines = [line for line in child.lines if 'starts' in line or 'on its way' in line]
    assert lines == ['[driver] on its way', '[INFO] [filter]: starts', '[INFO] [last]: starts']
    assert child.matching('system: 2 nodes and 3 processes ready in ')
    assert child.stop() == 0


def test_what_is_not_there_in_time_ends_the_start_and_what_was_there_is_said(compose, peer):
    text = f"""
        version: 1
        nodes:
          late:
            wait_for: {{topic: scam, timeout: 1.0}}
            {WAITING}
          free:
            on_start: parts:find_scan
            on_stop: {{behaviour: 'parts:tell', with: {{text: stops}}}}
        processes:
          driver: {{command: [sleep, '3600']}}
    """
    peer.run(peer.node.create_publisher, String, 'scan', 1)
    child = compose(text, CODE)

    assert child.wait() == 1
    assert child.lines == [
        '[INFO] [free]: stops',
        "[INFO] [composer]: process 'driver' was ended by SIGINT",
        "error: node 'late' (system.yaml:5) waited 1 s for the topic '/scam': nothing publishes it",
        "  help: did you mean '/scan'?",
    ]


@pytest.mark.parametrize(
    ('condition', 'trouble', 'help_line'),
    [
        ('action: grasp', "action '/grasp': nothing serves it", 'actions: /count'),
        (
            'node: /robot/ghost',
            "node '/robot/ghost': there is no such node",
            'nodes: /free, /peer',
        ),
        (
            'topic: held',
            "topic '/held': nothing publishes it but 'slow' of this system, which has not started",
            'published topics: /words',
        ),
    ],
)
def test_each_kind_says_what_there_is_instead(compose, peer, condition, trouble, help_line):
    pytest.importorskip('test_msgs')
    text = f"""
        version: 1
        nodes:
          late: {{wait_for: {{{condition}, timeout: 1}}}}
          slow:
            wait_for: {{topic: never, timeout: 3600}}
            publishers: {{held: {{type: std_msgs/msg/String, external: true}}}}
          free:
            on_start: parts:meet_peer
            publishers: {{words: {{type: std_msgs/msg/String, external: true}}}}
            actions: {{count: {{type: test_msgs/action/Fibonacci, behaviour: 'parts:compute'}}}}
    """
    child = compose(text, CODE)

    assert child.wait() == 1
    assert child.lines[-2:] == [
        f"error: node 'late' (system.yaml:4) waited 1 s for the {trouble}",
        f'  help: {help_line}',
    ]


def test_a_process_that_has_ended_badly_is_not_waited_for(compose):
    text = f"""
        version: 1
        nodes:
          late: {{wait_for: [{{topic: never, timeout: 3600}}, {{process: setup}}], {WAITING}}}
        processes:
          setup: {{command: [sh, -c, 'exit 3']}}
    """
    child = compose(text, CODE)

    assert child.wait() == 1
    assert child.lines[-1] == (
        "error: node 'late' (system.yaml:4) waits for the process 'setup': "
        'it has ended with exit code 3'
    )


def test_a_stop_ends_the_waiting(compose):
    text = f"""
        version: 1
        nodes:
          late:
            wait_for: {{topic: never, timeout: 3600}}
            on_stop: {{behaviour: 'parts:tell', with: {{text: late stops}}}}
            {WAITING}
          free:
            timers: {{t: {{period: 0.02, behaviour: 'parts:tell', with: {{text: tick}}}}}}
            on_stop: {{behaviour: 'parts:tell', with: {{text: free stops}}}}
    """
    child = compose(text, CODE)
    child.wait_for_line('tick')

    # Not all of it has started.
    assert child.stop(once_up=False) == 130
    assert child.lines[-1] == '[INFO] [free]: free stops'
    assert not child.matching('late')
    assert not child.matching(' ready in ')


def test_the_end_of_a_required_process_ends_the_waiting(compose):
    text = """
        version: 1
        nodes: {late: {wait_for: {topic: never, timeout: 3600}}}
        processes: {mission: {command: [sh, -c, 'sleep 0.2; exit 3'], on_exit: shutdown}}
    """

    assert compose(text).wait() == 1


def test_on_start_that_raises_after_a_wait_stops_those_that_have_started(compose):
    text = """
        version: 1
        nodes:
          late: {wait_for: {node: free}, on_start: 'parts:fail'}
          free: {on_stop: {behaviour: 'parts:tell', with: {text: stops}}}
    """
    child = compose(text, CODE)

    assert child.wait() == 1
    assert child.lines[-2:] == [
        '[INFO] [free]: stops',
        "error: node 'late': on_start raised OSError('no such device')",
    ]


def test_nodes_of_one_name_in_two_namespaces_both_start_and_stop(compose):
    text = """
        version: 1
        nodes:
          /left/arm: &arm
            timers: {t: {period: 0.02, behaviour: 'parts:tell', with: {text: tick}}}
            on_stop: {behaviour: 'parts:tell', with: {text: stops}}
          /right/arm: *arm
    """
    child = compose(dedent(text), CODE)
    child.wait_for_line('[left.arm]: tick')
    child.wait_for_line('[right.arm]: tick')

    assert child.stop() == 0
    assert sorted(child.matching('stops')) == [
        '[INFO] [left.arm]: stops',
        '[INFO] [right.arm]: stops',
    ]


def test_a_signal_ends_the_wait_at_any_line(context, executor):
    condition = ConditionSpec('topic', '/words', inf, None, ('nodes', 'late', 'wait_for'))
    waiter = Waiter(
        "node 'late'", (condition,), 0.0, lambda each: each.name, print, print, lambda: True
    )
    elsewhere = SimpleNamespace(find_hidden=frozenset)

    def wait(ends):
        """Wait until the handler of a signal runs, which does so between two lines."""
        stop, lines = StopRequest(), count()

        def trace(frame, event, _argument):
            is_of_wait = frame.f_globals['__name__'] in {'threading', wait_for_module.__name__}
            if is_of_wait and event == 'line' and next(lines) == ends:
                stop.make()
            return trace

        sys.settrace(trace)
        WaitingStarter(context, executor, {}, elsewhere, None).start_all([waiter], stop)

    for ends in range(50, 110):
        thread = threading.Thread(target=wait, args=(ends,), daemon=True)
        thread.start()
        thread.join(DEADLINE_SEC)
        assert not thread.is_alive(), ends
