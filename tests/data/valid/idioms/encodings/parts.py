import re
import sys

import numpy as np
from sensor_msgs.msg import Image, RegionOfInterest

SIMPLE = {'mono8': 'u1', 'mono16': 'u2', 'rgb8': 'u1', 'bgr8': 'u1'}
CHANNELS = {'rgb8': 3, 'bgr8': 3}


def dtype_of(encoding):
    if encoding in SIMPLE:
        return np.dtype(SIMPLE[encoding]), CHANNELS.get(encoding, 1)
    bits, kind, channels = re.match(r'(\d+)([FSU])C(\d)?', encoding).groups(default='1')
    return np.dtype({'F': 'f', 'S': 'i', 'U': 'u'}[kind] + str(int(bits) // 8)), int(channels)


def image(node):
    encodings = node.parameters.encodings
    index = node.own_state['index'] = (node.own_state.get('index', -1) + 1) % len(encodings)
    dtype, channels = dtype_of(encodings[index])
    pixels = (np.random.rand(4, 6, channels) * 200).astype(dtype)
    msg = Image(height=4, width=6, encoding=encodings[index], is_bigendian=int(sys.byteorder == 'big'))
    msg.step = pixels[0].nbytes
    msg.data.frombytes(memoryview(np.ascontiguousarray(pixels)).cast('B'))
    return msg


def analyse(node, msg):
    dtype, channels = dtype_of(msg.encoding)
    pixels = np.frombuffer(msg.data, dtype).reshape(msg.height, msg.width, channels)
    ys, xs = np.nonzero(pixels.max(axis=-1) > pixels.mean())
    if xs.size:
        x, y, width, height = xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1
        node.publish('roi', RegionOfInterest(x_offset=int(x), y_offset=int(y), width=int(width), height=int(height)))
        node.publish('roi', {'x_offset': x, 'y_offset': y, 'width': width, 'height': height, 'do_rectify': bool(x)})
    counts, _ = np.histogram(pixels, bins=4)
    return {'data': counts}
