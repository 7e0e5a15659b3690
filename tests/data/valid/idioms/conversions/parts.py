from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Self

from geometry_msgs.msg import Pose2D, PoseStamped, TwistStamped
from rclpy.time import Time


@dataclass
class Convertible:
    message_type: ClassVar[Any] = None

    @classmethod
    def from_msg(cls, msg) -> Self:
        raise NotImplementedError

    def to_msg(self):
        return self.message_type(**{f.name: getattr(self, f.name) for f in fields(self) if not f.metadata.get('local')})


@dataclass
class Planar(Convertible):
    message_type: ClassVar[Any] = Pose2D
    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0
    stamp: Time | None = field(default=None, metadata={'local': True})

    @classmethod
    def from_msg(cls, msg: PoseStamped) -> Self:
        q, p = msg.pose.orientation, msg.pose.position
        return cls(p.x, p.y, math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y**2 + q.z**2)), Time.from_msg(msg.header.stamp))

    def stamped(self, header) -> PoseStamped:
        out = PoseStamped(header=header)
        out.pose.position.x, out.pose.position.y = self.x, self.y
        out.pose.orientation.z, out.pose.orientation.w = math.sin(self.theta / 2), math.cos(self.theta / 2)
        return out

    def __sub__(self, other: Planar) -> Planar:
        return Planar(*(getattr(self, f) - getattr(other, f) for f in ('x', 'y', 'theta')))


def pose(node):
    angle = node.now().nanoseconds / 1e9 % math.pi
    header = {'stamp': node.now(), 'frame_id': 'map'}
    return {'header': header, 'pose': {'orientation': {'z': math.sin(angle / 2), 'w': math.cos(angle / 2)}, 'position': {'x': angle}}}


def flatten(node, msg: PoseStamped):
    return Planar.from_msg(msg).to_msg()


def round_trip(node, msg: PoseStamped):
    return Planar.from_msg(msg).stamped(msg.header)


def differentiate(node, msg: PoseStamped) -> TwistStamped | None:
    current = Planar.from_msg(msg)
    previous: Planar | None = node.own_state.get('previous')
    node.own_state['previous'] = current
    if previous is None or previous.stamp is None or current.stamp is None:
        return None
    dt = (current.stamp - previous.stamp).nanoseconds / 1e9
    delta = current - previous
    return TwistStamped(header=msg.header, twist=_twist(delta, dt))


def _twist(delta, dt):
    from geometry_msgs.msg import Twist
    twist = Twist()
    twist.linear.x, twist.linear.y, twist.angular.z = (v / (dt or 1) for v in (delta.x, delta.y, delta.theta))
    return twist
