"""Endpoints of one topic that can never match: both ends and the reason are logged."""

import pytest

pytest.importorskip('rclpy')

from rclpy.qos import QoSProfile, ReliabilityPolicy
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
  other:
    subscriptions:
      adapted: {type: std_msgs/msg/String, topic: /late, qos: best_available, behaviour: 'parts:hear'}
      typed: {type: std_msgs/msg/String, topic: /typed, behaviour: 'parts:hear'}
"""

BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def test_each_end_is_told_of_once_with_what_to_do_and_those_that_fit_are_heard(compose, peer):
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    for _ in range(3):
        peer.run(peer.node.create_publisher, String, '/scan', BEST_EFFORT)
    peer.run(peer.node.create_subscription, String, '/words', print, 10)
    peer.run(peer.node.create_publisher, String, '/late', BEST_EFFORT)
    peer.run(peer.node.create_publisher, Int32, '/typed', 10)

    child.wait_for_line(
        "[WARN] [robot.ears]: subscription 'scan' (system.yaml:7) gets nothing from '/peer': "
        'reliability: best_effort is offered there, reliable is requested here; '
        "set 'qos: {reliability: best_effort}' here, or 'qos: {reliability: reliable}' there"
    )
    child.wait_for_line(
        "[WARN] [mouth]: publisher 'words' (system.yaml:10) sends nothing to '/peer': "
        'reliability: best_effort is offered here, reliable is requested there; '
        "set 'qos: {reliability: reliable}' here, or 'qos: {reliability: best_effort}' there"
    )
    child.wait_for_line(
        "subscription 'typed' (system.yaml:14) gets nothing from '/peer': "
        'its type is std_msgs/msg/Int32 there, and std_msgs/msg/String here'
    )
    # All policies at fault are named.
    child.wait_for_line(
        "subscription 'adapted' (system.yaml:13) gets nothing from '/peer': reliability: "
        'best_effort is offered there, reliable is requested here; durability: volatile is '
        'offered there, transient_local is requested here; liveliness: automatic is offered '
        "there, manual_by_topic is requested here; set 'qos: {reliability: best_effort, "
        "durability: volatile, liveliness: automatic}' here, or 'qos: {reliability: reliable, "
        "durability: transient_local, liveliness: manual_by_topic}' there"
    )
    publisher = peer.advertise(String, '/scan')
    publisher.publish(String(data='hello'))
    child.wait_for_line('heard hello')
    assert child.stop() == 0
    assert len(child.matching('[WARN]')) == 4


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


def test_missed_deadlines_and_lost_liveliness_are_logged_once_then_counted(compose):
    text = """
        version: 1
        qos:
          brisk: {deadline: 0.1, liveliness: manual_by_topic, liveliness_lease_duration: 0.2}
        nodes:
          mouth:
            publishers: {words: {type: std_msgs/msg/String, qos: brisk}}
            timers: {speak: {period: 1, publish: words, message: hello}}
          ears:
            subscriptions: {words: {type: std_msgs/msg/String, qos: brisk, behaviour: 'parts:hear'}}
    """
    child = compose(text, CODE)
    lines = [
        f'[WARN] {line}'
        for line in (
            "[mouth]: publisher 'words' (system.yaml:7) published nothing within its deadline of 0.1 s",
            "[mouth]: publisher 'words' (system.yaml:7) lost its liveliness: it published nothing within its lease of 0.2 s",
            "[ears]: subscription 'words' (system.yaml:10) got no message within its deadline of 0.1 s",
            "[ears]: subscription 'words' (system.yaml:10) lost a publisher: no sign of life within the lease of 0.2 s",
        )
    ]
    for line in lines:
        child.wait_for_line(line)
    child.wait_for_line('heard hello', times=3)
    assert child.stop() == 0
    for line in lines:
        first, *counted = child.matching(line)
        assert first == line
        assert all(each.endswith((' more times', ', once more')) for each in counted)
    assert child.matching('within its deadline of 0.1 s, ')
