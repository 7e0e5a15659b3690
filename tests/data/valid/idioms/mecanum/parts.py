import numpy as np
from geometry_msgs.msg import TwistWithCovarianceStamped
from std_msgs.msg import Float32MultiArray, MultiArrayDimension, MultiArrayLayout

WHEELS = [f'{a}_{b}' for a in ('front', 'rear') for b in ('left', 'right')]


def _jacobian(node):
    p = node.parameters
    if (cached := vars(node.state).get('jacobian')) is None:
        k = p.lx + p.ly
        cached = node.state.jacobian = np.array([[1, -1, -k], [1, 1, k], [1, 1, -k], [1, -1, k]]) / p.radius
    return cached


def inverse(node, cmd):
    speeds = _jacobian(node) @ [cmd.linear.x, cmd.linear.y, cmd.angular.z]
    for wheel, speed in zip(WHEELS, speeds):
        node.publish(f'{wheel}/speed', speed)
    dims = [MultiArrayDimension(label='wheels', size=speeds.size, stride=speeds.size)]
    return Float32MultiArray(layout=MultiArrayLayout(dim=dims), data=speeds.astype(np.float32).tolist())


def forward(node, msg):
    assert msg.layout.dim[0].size == len(WHEELS)
    vx, vy, wz = np.linalg.pinv(_jacobian(node)) @ msg.data
    out = TwistWithCovarianceStamped()
    out.header.stamp = node.now().to_msg()
    out.twist.twist.linear.x = vx
    out.twist.twist.linear.y = vy
    out.twist.twist.angular.z = wz
    covariance = np.zeros((6, 6))
    covariance[np.diag_indices(6)] = [0.01, 0.01, 0, 0, 0, 0.05]
    out.twist.covariance = covariance.flatten()
    return out


def fly(node):
    t = node.now().nanoseconds / 1e9
    return {'linear': {'x': np.sin(t), 'y': np.cos(t)}, 'angular': {'z': np.float32(0.1)}}
