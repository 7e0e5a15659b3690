from __future__ import annotations

import math
from typing import NamedTuple, Optional

import numpy as np
from geometry_msgs.msg import Quaternion, Vector3
from rclpy.time import Time
from sensor_msgs.msg import Imu, MagneticField


class Angles(NamedTuple):
    roll: float
    pitch: float
    yaw: float

    def to_quaternion(self) -> Quaternion:
        (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in self)
        return Quaternion(
            x=sr * cp * cy - cr * sp * sy, y=cr * sp * cy + sr * cp * sy,
            z=cr * cp * sy - sr * sp * cy, w=cr * cp * cy + sr * sp * sy,
        )


def sample(node):
    noise = np.random.default_rng().normal(0, 0.01, (3, 3))
    imu = Imu()
    imu.header.stamp = node.now().to_msg()
    imu.header.frame_id = 'imu_link'
    imu.linear_acceleration = Vector3(**{k: float(v) for k, v in zip('xyz', noise[0] + [0, 0, 9.81])})
    imu.angular_velocity.x, imu.angular_velocity.y, imu.angular_velocity.z = map(float, noise[1])
    imu.orientation_covariance[0] = -1
    imu.angular_velocity_covariance = np.diag([1e-4] * 3).ravel()
    node.publish('imu/data_raw', imu)
    mag = MagneticField(header=imu.header)
    mag.magnetic_field.x, mag.magnetic_field.y = 2e-5 * (1 + noise[2, 0]), 0.0
    node.publish('imu/mag', mag)


def keep_heading(node, mag: MagneticField) -> None:
    field = mag.magnetic_field
    node.state.heading = math.atan2(-field.y, field.x)


def filter_imu(node, raw: Imu) -> Optional[Imu]:
    heading: float = vars(node.state).get('heading', 0.0)
    acc, gyro = raw.linear_acceleration, raw.angular_velocity
    measured = Angles(math.atan2(acc.y, acc.z), math.atan2(-acc.x, math.hypot(acc.y, acc.z)), heading)
    stamp = Time.from_msg(raw.header.stamp)
    last: tuple[Time, Angles] | None = node.own_state.get('last')
    if last is None:
        node.own_state['last'] = stamp, measured
        return None
    dt = (stamp - last[0]).nanoseconds / 1e9
    a = node.parameters.alpha
    rates = (gyro.x, gyro.y, gyro.z)
    angles = Angles(*(a * (p + r * dt) + (1 - a) * m for p, r, m in zip(last[1], rates, measured)))
    node.own_state['last'] = stamp, angles
    raw.orientation = angles.to_quaternion()
    raw.orientation_covariance = [1e-3 if i % 4 == 0 else 0.0 for i in range(9)]
    node.publish('rpy', {'header': raw.header, 'vector': dict(zip('xyz', angles))})
    return raw
