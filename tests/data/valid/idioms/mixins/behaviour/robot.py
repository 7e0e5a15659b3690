from __future__ import annotations

import math
import typing as t

from geometry_msgs import msg as geometry

from .base import CountingMixin, ParameterMixin, once

if t.TYPE_CHECKING:
    from std_msgs.msg import Float32


@once
class Robot(ParameterMixin, CountingMixin):
    names = ('speed', 'turn', 'rate')

    def drive(self, heading: float) -> geometry.Twist:
        self.count('drive')
        twist = geometry.Twist()
        twist.linear.x = self.speed * math.cos(heading)
        twist.angular.z = -self.turn * heading
        return twist


def heading(node) -> float:
    return math.sin(node.now().nanoseconds * 1e-9 * Robot(node).rate)


def on_heading(node, message: Float32) -> geometry.Twist:
    return Robot(node).drive(message.data)


def stats(node) -> str | None:
    return ' '.join(f'{k}:{v}' for k, v in Robot(node).counts.items()) or None
