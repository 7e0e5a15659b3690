import math

import numpy as np
from geometry_msgs.msg import Pose, PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty


class Particles:
    def __init__(self, n, seed=0):
        self.rng = np.random.default_rng(seed)
        self.poses = self.rng.uniform(-1, 1, (n, 3))
        self.weights = np.full(n, 1 / n)

    def __len__(self):
        return len(self.weights)

    def __iter__(self):
        yield from self.poses

    def move(self, v, w, dt, alpha):
        theta = self.poses[:, 2]
        step = np.stack([v * np.cos(theta), v * np.sin(theta), np.full(len(self), w)], axis=1) * dt
        self.poses += step + self.rng.normal(0, alpha * dt, step.shape)

    @property
    def mean(self):
        return np.average(self.poses, axis=0, weights=self.weights)

    @property
    def covariance(self):
        return np.cov(self.poses.T, aweights=self.weights)


def _particles(node):
    try:
        return node.state.particles
    except AttributeError:
        node.state.particles = Particles(node.parameters.particles)
    return node.state.particles


def odom(node):
    msg = Odometry()
    msg.twist.twist.linear.x = 0.1
    return msg


def motion(node, msg):
    twist = msg.twist.twist
    _particles(node).move(twist.linear.x, twist.angular.z, 0.05, node.parameters.alpha)


def _pose(x, y, theta):
    pose = Pose()
    pose.position.x, pose.position.y = float(x), float(y)
    pose.orientation.z, pose.orientation.w = math.sin(theta / 2), math.cos(theta / 2)
    return pose


def cloud(node):
    if node.own_state.setdefault('calls', 0) == 3:
        node.own_state['calls'] = 0
        return None
    node.own_state['calls'] += 1
    array = PoseArray(poses=[_pose(*p) for p in _particles(node)])
    array.header.frame_id = 'map'
    return array


def estimate(node, cloud):
    particles = _particles(node)
    out = PoseWithCovarianceStamped(header=cloud.header)
    out.pose.pose = _pose(*particles.mean)
    full = np.zeros((6, 6))
    full[np.ix_((0, 1, 5), (0, 1, 5))] = particles.covariance
    out.pose.covariance = full.flatten().tolist()
    return out


def scatter(node, request):
    if hasattr(node.state, 'particles'):
        del node.state.particles
    return Empty.Response()


async def ask_scatter(node):
    await node.call_async('reinitialize_global_localization', {})
