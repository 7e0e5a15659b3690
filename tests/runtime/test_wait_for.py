"""`wait_for`: nodes and processes start in the order that they ask for, without any sleep."""

import sys

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import String
from std_srvs.srv import Trigger

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
            remap: {{said: words}}
            wait_for: {{topic: said}}
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
    """
    child = compose(text, CODE)

    assert child.wait() == 1
    assert child.lines[-2:] == [
        f"error: node 'late' (system.yaml:4) waited 1 s for the {trouble}",
        f'  help: {help_line}',
    ]


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
