from __future__ import annotations

import sys
from typing import TYPE_CHECKING, cast

from rclpy.clock import Clock, ClockType
from rclpy.time import Time
from std_msgs.msg import Header

if TYPE_CHECKING or sys.version_info < (3, 0):
    from builtin_interfaces.msg import Duration as DurationMsg
    from composer import Node

STEADY = Clock(clock_type=ClockType.STEADY_TIME)


def beat(node: Node) -> Header | None:
    n = node.own_state['n'] = cast(int, node.own_state.get('n', 0)) + 1
    if 8 < n % 16:
        return None
    return Header(stamp=node.now().to_msg(), frame_id=str(n))


def feed(node: Node, header: Header) -> DurationMsg:
    node.state.fed = STEADY.now()
    lateness = node.now() - Time.from_msg(header.stamp)
    return lateness.to_msg()


def check(node: Node) -> bool:
    fed: Time | None = getattr(node.state, 'fed', None)
    if fed is None:
        return False
    age = STEADY.now() - fed
    alive = age.nanoseconds < node.parameters.timeout * 1e9
    if not alive:
        del node.state.fed
    return alive
