"""Behaviours that end what belongs to the system, or what is their own."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import rclpy

def destroy_node(node):
    node.ros.destroy_node()

def shutdown_default(node):
    rclpy.shutdown()

def shutdown_context(node):
    node.ros.context.shutdown()

def shutdown_by_name(node):
    rclpy.shutdown(context=node.ros.context)

def try_shutdown_context(node):
    node.ros.context.try_shutdown()

def shutdown_executor(node):
    node.ros.executor.shutdown()

def spin(node):
    rclpy.spin_once(node.ros, timeout_sec=0.1)  # composer: ignore[bad-call]

async def destroy_node_async(node):
    node.ros.destroy_node()

def destroy_own_timer(node):
    node.logger.info('destroying')
    for timer in list(node.ros.timers):
        node.ros.destroy_timer(timer)

def destroy_all(node):
    node.logger.info('destroying')
    for destroy, entities in (
        (node.ros.destroy_timer, node.ros.timers),
        (node.ros.destroy_subscription, node.ros.subscriptions),
        (node.ros.destroy_publisher, node.ros.publishers),
        (node.ros.destroy_service, node.ros.services),
        (node.ros.destroy_client, node.ros.clients),
    ):
        for entity in list(entities):
            destroy(entity)

def destroy_for_sure(node):
    from rclpy.node import Node

    node.logger.info('destroying')
    Node.destroy_node(node.ros)

def shutdown_for_sure(node):
    from rclpy.context import Context

    # It may be called again before the system ends.
    if node.ros.context.ok():
        Context.shutdown(node.ros.context)

def live(node):
    node.logger.info('alive')

def hear(node, message):
    pass
"""

GOOD = """
  good:
    timers: {live: {period: 0.02, behaviour: 'parts:live'}}
    on_stop: parts:live
"""


def bad(name, behaviour):
    # With a parameter, its services are there from the start: a behaviour destroys them whole.
    return f"""
  {name}:
    parameters: {{number: 1}}
    publishers: {{words: std_msgs/msg/String}}
    subscriptions: {{words: {{type: std_msgs/msg/String, behaviour: 'parts:hear'}}}}
    service_clients: {{ask: std_srvs/srv/Trigger}}
    timers: {{fail: {{period: 0.05, behaviour: 'parts:{behaviour}'}}}}
    on_stop: parts:live
"""


def system(*behaviours):
    """Return a system with a node for each behaviour, with its name, and a good one."""
    nodes = ''.join(bad(behaviour, behaviour) for behaviour in behaviours)
    return f'version: 1\nnodes:\n{nodes}{GOOD}'


RESERVED = {
    'destroy_node': ('node', 'destroy_node()'),
    'destroy_node_async': ('node', 'destroy_node()'),
    'shutdown_context': ('context', 'shutdown()'),
    'shutdown_by_name': ('context', 'shutdown()'),
    'try_shutdown_context': ('context', 'try_shutdown()'),
    'shutdown_executor': ('executor', 'shutdown()'),
}


def test_a_behaviour_cannot_end_what_belongs_to_the_system(compose):
    others = ('shutdown_default', 'spin')
    text = system(*RESERVED, *others)
    child = compose(text, CODE)
    for name, (owned, method) in RESERVED.items():
        place = text[: text.index(f"'parts:{name}'")].count('\n') + 1
        child.wait_for_line(
            f"[ERROR] [{name}]: timer 'fail' (system.yaml:{place}) raised ReservedMethodError: "
            f'the {owned} belongs to the system, so a behaviour cannot call {method}'
        )
        child.wait_for_line(
            f"[ERROR] [{name}]: timer 'fail' (system.yaml:{place}) raised ", times=2
        )
    # The default context is not that of the system.
    for name in others:
        child.wait_for_line(f"[ERROR] [{name}]: timer 'fail' (system.yaml:")
    child.wait_for_line('help: to end the system call node.shutdown()', times=len(RESERVED))
    alive = len(child.matching('[good]: alive'))
    child.wait_for_line('[good]: alive', times=alive + 10)
    child.wait_for_line(' more times, last: ReservedMethodError')
    assert child.stop() == 0

    told = [line for line in child.matching('ReservedMethodError: ') if line.startswith('  ')]
    assert len(told) == len(RESERVED)


def test_others_live_on_when_a_behaviour_destroys_what_its_node_has(compose):
    names = ('destroy_own_timer', 'destroy_all', 'destroy_for_sure')
    child = compose(system(*names), CODE)
    for name in names:
        child.wait_for_line(f'[{name}]: destroying')
    alive = len(child.matching('[good]: alive'))
    child.wait_for_line('[good]: alive', times=alive + 20)
    assert child.stop() == 0, child.output

    for name in names:
        assert len(child.matching(f'[{name}]: alive')) == 1
    assert not child.matching('Traceback')
    assert not child.matching('[ERROR]')


def test_a_system_whose_ros_was_shut_down_says_so_and_ends(compose):
    child = compose(system('shutdown_for_sure'), CODE)

    assert child.wait() == 1
    assert child.matching('[ERROR] [composer]: the ROS context was shut down, so the system ends')
    assert child.matching('[good]: alive')
    assert not child.matching('Traceback')
