from __future__ import annotations

import math
from typing import Optional

from geometry_msgs.msg import Point, Quaternion, Twist
from nav_msgs.msg import Odometry


def euler_from_quaternion(q: Quaternion) -> tuple[float, float, float]:
    t3, t4 = 2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z)
    return 0.0, 0.0, math.atan2(t3, t4)


class Robot:
    __slots__ = ('_odom', 'goal', '_node')

    def __init__(self, node):
        self._node = node
        self._odom: Optional[Odometry] = None
        self.goal = Point(**dict(zip('xy', node.parameters.goal)))

    @property
    def position(self) -> Point:
        return self._odom.pose.pose.position

    @property
    def yaw(self) -> float:
        *_, yaw = euler_from_quaternion(self._odom.pose.pose.orientation)
        return yaw

    def __bool__(self):
        return self._odom is not None

    def update(self, odom):
        self._odom = odom

    def __sub__(self, other: Point) -> complex:
        p = self.position
        return complex(other.x - p.x, other.y - p.y)

    def steer(self) -> Twist:
        delta = self - self.goal
        angle = math.remainder(math.atan2(delta.imag, delta.real) - self.yaw, math.tau)
        cmd = Twist()
        k = self._node.parameters
        cmd.linear.x, cmd.angular.z = k.kp_linear * abs(delta), k.kp_angular * angle
        return cmd


def create(node):
    node.state.robot = Robot(node)


def on_odom(node, odom):
    node.state.robot.update(odom)


def control(node):
    return node.state.robot.steer() if (robot := node.state.robot) and robot.position else None


def stop(node):
    node.publish('cmd_vel', Twist())
    node.state.robot = None


def simulate(node):
    odom = Odometry()
    odom.header.stamp = node.now().to_msg()
    odom.pose.pose.orientation.w = 1.0
    odom.pose.pose.position = Point(x=0.1)
    return odom
