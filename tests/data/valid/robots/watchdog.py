from __future__ import annotations

from collections.abc import Iterator

from composer import Node
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan


def touch(node: Node, name: str) -> None:
    node.state.ages[name] = node.now()


def odom(node: Node, message: Odometry) -> None:
    if message.twist.covariance[0] >= 0.0:
        touch(node, 'odom')


def scan(node: Node, message: LaserScan) -> None:
    if any(message.range_min < each < message.range_max for each in message.ranges):
        touch(node, 'scan')


def ages(node: Node) -> Iterator[tuple[str, float]]:
    now = node.now()
    for name in node.parameters.topics:
        heard = node.state.ages.get(name)
        yield name, (now - heard).nanoseconds / 1e9 if heard else float('inf')


def look(node: Node) -> DiagnosticArray:
    array = DiagnosticArray()
    array.header.stamp = node.now().to_msg()
    is_ok = True
    for name, age in ages(node):
        status = DiagnosticStatus(name=name, level=DiagnosticStatus.OK)
        status.values = [KeyValue(key='age', value=f'{age:.2f}')]
        if age > node.parameters.timeout:
            status.level = DiagnosticStatus.ERROR
            status.message = 'too old'
            is_ok = False
        array.status.append(status)
    if is_ok != node.state.was_ok:
        node.state.was_ok = is_ok
        node.publish('estop', not is_ok)
        if not is_ok:
            node.call('brake')
    return array
