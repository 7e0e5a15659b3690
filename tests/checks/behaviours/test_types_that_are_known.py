"""What behaviours keep in the state, make with NumPy or create has a type, and is held to it."""

import pytest

SYSTEM = """
  rover:
    state: {total: 0, label: idle, items: []}
    publishers:
      whole: {type: std_msgs/msg/Int32, external: true}
      text: {type: std_msgs/msg/String, external: true}
      many: {type: std_msgs/msg/Int32MultiArray, external: true}
      imu: {type: sensor_msgs/msg/Imu, external: true}
    subscriptions: {in: {type: std_msgs/msg/Float64, external: true, behaviour: parts:hear}}
"""
CODE = """
import json
from array import array
import numpy as np
from dataclasses import dataclass
from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import Imu
from std_msgs.msg import String

@dataclass(frozen=True)
class Limits:
    high: float


def pair():
    return 1.0, 2.0


def near(value):
    if value > 1:
        return 'near'


def hear(node, message):
    {}
    for name in ('whole', 'text', 'many', 'imu'):
        node.publish(name, {{}})
"""


@pytest.mark.ros
@pytest.mark.parametrize(
    ('line', 'rule'),
    [
        ("node.state.total += 0.5; node.publish('whole', node.state.total)", 'field-type'),
        ("node.state.total += 1; node.publish('whole', node.state.total)", None),
        ("node.publish('whole', node.state.label)", 'field-type'),
        ("node.publish('text', 'n=' + node.state.total)", 'bad-call'),
        ("node.publish('text', node.state.label + '!')", None),
        ('node.state.items += (1, 2)', None),
        ('node.state.items.push(1)', 'unknown-attribute'),
        ("node.publish('many', {'data': np.zeros(3)})", 'field-type'),
        ("node.publish('many', {'data': np.zeros(3, dtype=int)})", None),
        ("node.publish('many', {'data': array('d', [1.0])})", 'field-type'),
        ("node.publish('many', {'data': array('i', [1])})", None),
        ("node.publish('imu', {'orientation_covariance': np.eye(6) * 0.1})", 'field-length'),
        ("node.publish('imu', {'orientation_covariance': np.eye(3).flatten()})", None),
        ("node.publish('imu', {'orientation_covariance': np.diag([1.0, 2.0])})", 'field-length'),
        ("node.create_publisher('std_msgs/msg/String', 'x', latch=True)", 'bad-call'),
        ("node.create_publisher('std_msgs/msg/String', 'x', qos='sensor_data')", None),
        ('node.publish(\'text\', json.dumps({"at": node.now()}))', 'bad-call'),
        ('a, b, c = pair()', 'bad-index'),
        ('a, b, c = Imu().angular_velocity_covariance', 'bad-index'),
        ("node.publish('imu', {'header': {'stamp': node.now()}})", None),
        ("node.publish('imu', {'header': {'stamp': node.now().to_msg}})", 'field-type'),
        ('Imu().header.stamp = node.now()', 'field-type'),
        ('Imu().header.stamp = node.now().to_msg()', None),
        ("node.publish('text', node.state.label.upper)", 'field-type'),
        ('DiagnosticStatus(level=1)', 'field-type'),
        ('DiagnosticStatus(level=DiagnosticStatus.WARN)', None),
        ("print(f'{node.state.label:.2f}')", 'bad-call'),
        ("print(f'{message.data:.2f} {node.state.label:>9}')", None),
        ('node.ros.get_topics_names()', 'unknown-attribute'),
        ('node.ros.get_topic_names_and_types(no_demangle=True)', None),
        ("node.ros.create_publisher(String, 'x', qos=10)", 'bad-call'),
        ("node.ros.create_publisher(String, 'x', 10)", None),
        ("node.ros.get_logger().warn_once('x')", 'unknown-attribute'),
        ('Limits(1.0).high = 2.0', 'unknown-attribute'),
        ('Limits(1.0).other', 'unknown-attribute'),
        ('a, *b = pair()', None),
        ("node.publish('text', near(message.data))", 'field-type'),
        ('print(later); later = 1', 'undefined-name'),
    ],
)
def test_a_value_of_another_type_is_found(check, line, rule):
    found = [each for _, each in check(SYSTEM, CODE.format(line))]
    assert found == ([rule] if rule else [])
