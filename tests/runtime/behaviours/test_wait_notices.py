"""What is not there yet is named while it is waited for, without any stack."""

import pytest

pytest.importorskip('rclpy')


pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
defaults: {namespace: robot, warn_after: 0.2}
processes:
  viewer: {command: [sleep, '60'], wait_for: {action: /spin}}
nodes:
  calling:
    service_clients: {ask: {type: std_srvs/srv/Trigger, external: true}}
    timers: {t: {period: 0.05, behaviour: 'parts:call'}}
  awaiting:
    service_clients: {ask: {type: std_srvs/srv/Trigger, external: true}}
    timers: {t: {period: 0.05, behaviour: 'parts:call_async', group: reentrant}}
  going:
    action_clients: {count: {type: test_msgs/action/Fibonacci, external: true}}
    timers: {t: {period: 0.05, behaviour: 'parts:send'}}
  setting:
    timers: {t: {period: 0.05, behaviour: 'parts:set'}}
  late: {wait_for: [{topic: words}, {service: ask}, {action: count}, {node: other}]}
"""

CODE = """
def call(node):
    node.call('ask', timeout=None)

async def call_async(node):
    await node.call_async('ask', timeout=None)

def send(node):
    node.send_goal('count', timeout=None)

def set(node):
    node.set_parameters('other', {'speed': 1}, timeout=None)

def give_up(node):
    node.call('ask', timeout=0.01)

def give_up_going(node):
    node.send_goal('count', timeout=0.01)
"""


def test_what_is_waited_for_is_named_once_and_no_stack_is_shown(compose):
    child = compose(SYSTEM, CODE)
    for line in (
        "[robot.calling]: Waiting for service '/robot/ask'…",
        "[robot.awaiting]: Waiting for service '/robot/ask'…",
        "[robot.going]: Waiting for action server '/robot/count'…",
        "[robot.setting]: Waiting for the parameter services of node '/robot/other'…",
        "[robot.late]: Waiting for a publisher of '/robot/words'…",
        "[robot.late]: Waiting for service '/robot/ask'…",
        "[robot.late]: Waiting for action server '/robot/count'…",
        "[robot.late]: Waiting for node '/robot/other'…",
        "[composer]: process 'viewer': Waiting for action server '/spin'…",
    ):
        child.wait_for_line(f'[INFO] {line}')
    assert child.stop(once_up=False) == 130, child.output
    assert len(child.matching('Waiting for')) == 9
    assert not child.matching('has been running')
    assert not child.matching('Traceback')


def test_a_server_that_is_not_there_in_time_is_an_error_without_a_stack(compose):
    text = """
        version: 1
        defaults: {namespace: robot}
        nodes:
          calling:
            service_clients: {ask: {type: std_srvs/srv/Trigger, external: true}}
            timers: {t: {period: 0.05, behaviour: 'parts:give_up'}}
          going:
            action_clients: {count: {type: test_msgs/action/Fibonacci, external: true}}
            timers: {t: {period: 0.05, behaviour: 'parts:give_up_going'}}
    """
    child = compose(text, CODE)
    child.wait_for_line(
        "[ERROR] [robot.calling]: timer 't' (system.yaml:7) raised ServiceNotAvailableError: "
        "no server of '/robot/ask' appeared within 0.01 s"
    )
    child.wait_for_line(
        "[ERROR] [robot.going]: timer 't' (system.yaml:10) raised ActionNotAvailableError: "
        "no server of the action '/robot/count' appeared within 0.01 s"
    )
    assert not child.matching('Traceback')
