from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from nav_msgs.msg import Odometry

H = np.eye(2, 4)


@dataclass
class Filter:
    x: NDArray[np.float64]
    q: float
    P: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))

    def predict(self, dt):
        F = np.eye(4) + dt * np.eye(4, k=2)
        self.x = F @ self.x
        self.P = F @ self.P @ F.T + self.q * dt * np.eye(4)

    def correct(self, z, R):
        y = z - H @ self.x
        K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + R)
        self.x = self.x + K @ y
        self.P = (np.eye(4) - K @ H) @ self.P
        return y


def reset(node):
    node.state.filter = Filter(np.array(node.parameters.initial), node.parameters.process_noise)


def measure(node):
    x, y = np.random.normal((1, 2), 0.1)
    covariance = np.zeros((6, 6))
    np.fill_diagonal(covariance[:2, :2], 0.01)
    return {'header': {'stamp': node.now(), 'frame_id': 'map'}, 'pose': {'pose': {'position': {'x': x, 'y': y}}, 'covariance': covariance}}


def predict(node):
    node.state.filter.predict(1 / 50)


def correct(node, msg):
    kf: Filter = node.state.filter
    p = msg.pose.pose.position
    R = np.reshape(msg.pose.covariance, (6, 6))[:2, :2]
    y = kf.correct(np.array([p.x, p.y]), R)
    node.publish('innovation', dict(zip('xy', y)))
    odom = Odometry(header=msg.header, child_frame_id='base')
    (odom.pose.pose.position.x, odom.pose.pose.position.y,
     odom.twist.twist.linear.x, odom.twist.twist.linear.y) = kf.x
    block = np.array(odom.pose.covariance).reshape(6, 6)
    block[:2, :2] = kf.P[:2, :2]
    odom.pose.covariance = block.ravel()
    odom.twist.covariance[0::7] = np.pad(np.diag(kf.P)[2:], (0, 4))
    return odom
