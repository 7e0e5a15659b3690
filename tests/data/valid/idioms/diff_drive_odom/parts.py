from __future__ import annotations

import math
from dataclasses import dataclass, field, astuple
from typing import TYPE_CHECKING

from geometry_msgs.msg import Quaternion, TransformStamped, Twist
from nav_msgs.msg import Odometry

if TYPE_CHECKING:
    from composer import Node


@dataclass
class Pose2D:
    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0

    def advance(self, v: float, w: float, dt: float) -> None:
        self.x += v * math.cos(self.theta + w * dt / 2) * dt
        self.y += v * math.sin(self.theta + w * dt / 2) * dt
        self.theta = math.remainder(self.theta + w * dt, math.tau)


@dataclass
class Tracker:
    pose: Pose2D = field(default_factory=Pose2D)
    twist: Twist = field(default_factory=Twist)
    last: float | None = None


def yaw_to_quaternion(yaw: float) -> Quaternion:
    return Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def command(node: Node) -> Twist:
    t = node.now().nanoseconds * 1e-9
    cmd = Twist()
    cmd.linear.x, cmd.angular.z = 0.2, math.sin(t)
    return cmd


def _tracker(node) -> Tracker:
    return vars(node.state).setdefault('tracker', Tracker())


def on_command(node: Node, msg: Twist) -> None:
    _tracker(node).twist = msg


def integrate(node: Node) -> Odometry | None:
    tracker, now = _tracker(node), node.now()
    seconds = now.nanoseconds / 1e9
    if tracker.last is None:
        tracker.last = seconds
        return None
    dt, tracker.last = seconds - tracker.last, seconds
    tracker.pose.advance(tracker.twist.linear.x, tracker.twist.angular.z, dt)
    x, y, theta = astuple(tracker.pose)

    odom = Odometry()
    odom.header.stamp = now.to_msg()
    odom.header.frame_id = getattr(node.parameters, 'frames.odom')
    odom.child_frame_id = node.parameters['frames.base']
    odom.pose.pose.position.x = x
    odom.pose.pose.position.y = y
    odom.pose.pose.orientation = (q := yaw_to_quaternion(theta))
    odom.twist.twist = tracker.twist
    odom.pose.covariance[0] = odom.pose.covariance[7] = 1e-3
    odom.pose.covariance[35] = 1e-2

    if node.parameters.publish_tf:
        tf = TransformStamped(header=odom.header, child_frame_id=odom.child_frame_id)
        tf.transform.translation.x, tf.transform.translation.y = x, y
        tf.transform.rotation = q
        node.publish('transform', tf)
    return odom
