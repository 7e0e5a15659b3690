import array

import numpy as np
from sensor_msgs.msg import Imu, LaserScan
from std_msgs.msg import Float64MultiArray, MultiArrayDimension


def scalars(node):
    a = np.arange(12).reshape(3, 4)
    node.publish('i32', a.sum())
    node.publish('i32', np.argmax(a))
    node.publish('u8', np.uint8(255))
    node.publish('f32', a.mean(dtype=np.float32))
    node.publish('f32', np.inf)
    node.publish('flag', (a > 3).any())
    node.publish('flag', np.isclose(a[0, 0], 0))
    node.publish('f32', a[1, 1])


def multi(node):
    data = np.random.default_rng(1).random((2, 3))
    msg = Float64MultiArray(data=data.ravel().tolist())
    for label, (size, stride) in zip(('rows', 'columns'), zip(data.shape, (data.size, data.shape[1]))):
        msg.layout.dim.append(MultiArrayDimension(label=label, size=size, stride=stride))
    return msg


def on_multi(node, msg):
    shape = [d.size for d in msg.layout.dim]
    data = np.asarray(msg.data).reshape(shape)
    u, s, vt = np.linalg.svd(data, full_matrices=False)
    with np.errstate(divide='ignore'):
        condition = s[0] / s[-1]
    return np.float32(condition)


def arrays(node):
    node.publish('ints', {'data': np.linspace(0, 100, 5).round().astype(int)})
    node.publish('ints', {'data': array.array('h', [1, 2, 3])})
    node.publish('bytes', {'data': np.packbits([1, 0, 1, 1, 0, 0, 0, 1])})
    node.publish('bytes', {'data': b'\x00\xff'})
    imu = Imu()
    imu.orientation_covariance[:] = 0.5
    imu.angular_velocity_covariance = np.eye(3).reshape(9)
    imu.linear_acceleration_covariance *= 2
    imu.linear_acceleration_covariance += np.eye(3).ravel()
    node.publish('imu', imu)
    scan = LaserScan(ranges=[1, 2.0] if False else [1.0, 2.0])
    scan.ranges.extend(np.ones(3, np.float32))
    scan.intensities = array.array('f', (0.0 for _ in scan.ranges))
    node.publish('scan', scan)
