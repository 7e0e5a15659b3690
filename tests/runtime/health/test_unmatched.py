"""Endpoints of one topic that can never match: both ends and the reason are logged."""

import pytest

pytest.importorskip('rclpy')

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32, String

pytestmark = pytest.mark.ros

CODE = """
def hear(node, message):
    node.logger.info(f'heard {message.data}')
"""

SYSTEM = """
version: 1
nodes:
  ears:
    namespace: robot
    subscriptions:
      scan: {type: std_msgs/msg/String, topic: /scan, behaviour: 'parts:hear'}
  mouth:
    publishers:
      words: {type: std_msgs/msg/String, topic: /words, qos: {reliability: best_effort}}
"""

BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def test_ends_with_other_qos_are_named_with_what_to_do_about_it(compose, peer):
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    peer.node.create_publisher(String, '/scan', BEST_EFFORT)
    peer.node.create_subscription(String, '/words', print, 10)

    child.wait_for_line(
        "[WARN] [robot.ears]: subscription 'scan' (system.yaml:7) gets nothing from '/peer': "
        'reliability: best_effort is offered there, reliable is requested here; '
        "set 'qos: {reliability: best_effort}' here, or reliable there"
    )
    child.wait_for_line(
        "[WARN] [mouth]: publisher 'words' (system.yaml:10) sends nothing to '/peer': "
        'reliability: best_effort is offered here, reliable is requested there; '
        "set 'qos: {reliability: reliable}' here, or best_effort there"
    )


def test_each_end_is_told_of_once_and_those_that_fit_are_heard(compose, peer):
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    for _ in range(3):
        peer.node.create_publisher(String, '/scan', BEST_EFFORT)
    child.wait_for_line("gets nothing from '/peer'")
    publisher = peer.advertise(String, '/scan')
    publisher.publish(String(data='hello'))
    child.wait_for_line('heard hello')
    latched = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    peer.node.create_subscription(String, '/words', print, latched)
    child.wait_for_line("sends nothing to '/peer'")
    assert child.stop() == 0

    assert len(child.matching('[WARN]')) == 2


def test_two_nodes_that_meet_by_a_rule_of_the_command_line_are_both_told(compose):
    text = """
        version: 1
        nodes:
          ears:
            subscriptions:
              map: {type: std_msgs/msg/String, behaviour: 'parts:hear', qos: {durability: transient_local}}
          mouth:
            publishers: {words: std_msgs/msg/String}
    """
    child = compose(text, CODE, '--ros-args', '-r', 'mouth:words:=map')

    child.wait_for_line(
        "[WARN] [ears]: subscription 'map' (system.yaml:6) gets nothing from '/mouth': "
        'durability: volatile is offered there, transient_local is requested here; '
    )
    child.wait_for_line(
        "[WARN] [mouth]: publisher 'words' (system.yaml:8) sends nothing to '/ears': "
        'durability: volatile is offered here, transient_local is requested there; '
    )


def test_an_end_of_another_type_is_named_with_both_types(compose, peer):
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    peer.node.create_publisher(Int32, '/scan', 10)

    child.wait_for_line(
        "[WARN] [robot.ears]: subscription 'scan' (system.yaml:7) gets nothing from '/peer': "
        'its type is std_msgs/msg/Int32 there, and std_msgs/msg/String here'
    )
