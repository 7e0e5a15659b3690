import queue
import struct
import threading

from sensor_msgs.msg import Imu

FRAME = struct.Struct('<6f')
LINES: 'queue.Queue[bytes]' = queue.Queue(maxsize=100)


class Port:
    def __init__(self, path):
        self.path = path
        self.is_open = True

    def read(self):
        return FRAME.pack(0.0, 0.0, 0.1, 0.0, 0.0, 9.81)

    def close(self):
        self.is_open = False


def read_all(node, port):
    while port.is_open and not node.stopping:
        try:
            LINES.put(port.read(), timeout=0.1)
        except queue.Full:
            node.logger.warning('the queue is full', throttle_duration_sec=1.0)
        node.sleep(1 / node.parameters.rate)


def begin(node):
    node.state.port = Port(node.parameters.port)
    node.state.errors = 0
    node.state.thread = threading.Thread(target=read_all, args=(node, node.state.port))
    node.state.thread.start()


def poll(node):
    while not LINES.empty():
        line = LINES.get_nowait()
        try:
            gx, gy, gz, ax, ay, az = FRAME.unpack(line)
        except struct.error:
            node.state.errors += 1
            continue
        message = Imu()
        message.header.frame_id = 'imu'
        message.header.stamp = node.now().to_msg()
        bias = node.parameters.bias
        rates = [rate - offset for rate, offset in zip((gx, gy, gz), bias, strict=True)]
        for axis, rate, acceleration in zip('xyz', rates, (ax, ay, az), strict=True):
            setattr(message.angular_velocity, axis, rate)
            setattr(message.linear_acceleration, axis, acceleration)
        message.orientation_covariance[0] = -1.0
        node.publish('imu', message)


def count(node):
    return {'data': node.state.errors}


def calibrate(node, request):
    samples = [FRAME.unpack(LINES.get(timeout=1.0))[:3] for _ in range(10)]
    bias = [sum(axis) / len(samples) for axis in zip(*samples, strict=True)]
    node.set_parameters(node.name, {'bias': bias})
    return {'success': True, 'message': f'{bias}'}


def end(node):
    node.state.port.close()
    node.state.thread.join(timeout=1.0)
