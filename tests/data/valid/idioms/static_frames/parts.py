from __future__ import annotations

import math

import numpy as np
from composer import Node
from geometry_msgs.msg import PointStamped, Quaternion, Transform, TransformStamped, Vector3


def quaternion_from_euler(ai: float, aj: float, ak: float) -> np.ndarray:
    ci, si = math.cos(ai / 2), math.sin(ai / 2)
    cj, sj = math.cos(aj / 2), math.sin(aj / 2)
    ck, sk = math.cos(ak / 2), math.sin(ak / 2)
    q = np.empty((4,))
    q[0] = si * cj * ck - ci * sj * sk
    q[1] = ci * sj * ck + si * cj * sk
    q[2] = ci * cj * sk - si * sj * ck
    q[3] = ci * cj * ck + si * sj * sk
    return q


def _transform(xyz, rpy) -> Transform:
    t = Transform()
    for axis, value in zip('xyz', xyz):
        setattr(t.translation, axis, value)
    t.rotation = Quaternion(**dict(zip('xyzw', quaternion_from_euler(*rpy).tolist())))
    return t


def broadcast_static(node: Node) -> None:
    parent, *children = node.parameters.frames
    for child in children:
        xyz, rpy = (node.parameters[f'{child}.{part}'] for part in ('xyz', 'rpy'))
        stamped = TransformStamped(child_frame_id=child, transform=_transform(xyz, rpy))
        stamped.header.frame_id, stamped.header.stamp = parent, node.now().to_msg()
        node.publish('tf_static', stamped)


def orbit(node: Node) -> TransformStamped:
    angle = node.now().nanoseconds / 1e9 % math.tau
    t = TransformStamped()
    t.header.stamp = node.now().to_msg()
    t.header.frame_id = 'world'
    t.child_frame_id = 'base_link'
    t.transform = _transform((math.cos(angle), math.sin(angle), 0.0), (0, 0, angle))
    return t


class Buffer:
    def __init__(self):
        self._frames: dict[str, tuple[str, Transform]] = {}

    def set_transform(self, t: TransformStamped) -> None:
        self._frames[t.child_frame_id] = t.header.frame_id, t.transform

    def chain(self, frame: str):
        while frame in self._frames:
            frame, transform = self._frames[frame]
            yield frame, transform


BUFFER = Buffer()


def store(node: Node, msg: TransformStamped) -> None:
    BUFFER.set_transform(msg)


def _rotate(q: Quaternion, v: np.ndarray) -> np.ndarray:
    u = np.array([q.x, q.y, q.z])
    return v + 2 * np.cross(u, np.cross(u, v) + q.w * v)


def lookup(node: Node) -> PointStamped | None:
    v, root = np.zeros(3), None
    for root, transform in BUFFER.chain('camera'):
        shift: Vector3 = transform.translation
        v = _rotate(transform.rotation, v) + (shift.x, shift.y, shift.z)
    if root != 'world':
        return None
    out = PointStamped()
    out.header.frame_id = root
    out.point.x, out.point.y, out.point.z = v
    return out
