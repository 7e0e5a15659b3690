import zlib

import numpy as np
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

try:
    import cv2
except ImportError:
    cv2 = None

ENCODINGS = {'rgb8': (np.uint8, 3), 'mono8': (np.uint8, 1), '32FC1': (np.float32, 1)}


def to_array(msg: Image) -> np.ndarray:
    dtype, channels = ENCODINGS[msg.encoding]
    flat = np.frombuffer(msg.data, dtype=np.dtype(dtype).newbyteorder('>' if msg.is_bigendian else '<'))
    shape = (msg.height, msg.width) if channels == 1 else (msg.height, msg.width, channels)
    return flat.reshape(shape)


def to_image(array: np.ndarray, encoding: str, header=None) -> Image:
    msg = Image(height=array.shape[0], width=array.shape[1], encoding=encoding)
    msg.step = array.strides[0]
    msg.data = array.tobytes()
    if header is not None:
        msg.header = header
    return msg


def grab(node):
    h, w = node.parameters.height, node.parameters.width
    frame = np.zeros((h, w, 3), np.uint8)
    shift = node.own_state['shift'] = (node.own_state.get('shift', 0) + 1) % w
    frame[:, shift] = (255, 128, 0) if not node.parameters.burger_mode else 255
    msg = to_image(frame, 'rgb8')
    msg.header.stamp = node.now().to_msg()
    msg.header.frame_id = 'camera'
    return msg


def to_mono(node, msg):
    rgb = to_array(msg)
    if cv2 is not None:
        grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    else:
        grey = (rgb @ np.array([0.299, 0.587, 0.114])).astype(np.uint8)
    jpeg = CompressedImage(header=msg.header, format='zlib')
    jpeg.data = zlib.compress(grey.tobytes())
    node.publish('compressed', jpeg)
    k = np.diag([500.0, 500.0, 1.0])
    k[:2, 2] = msg.width / 2, msg.height / 2
    info = CameraInfo(header=msg.header, width=msg.width, height=msg.height, distortion_model='plumb_bob')
    info.d = [0.0] * 5
    info.k = k.ravel()
    info.r = np.eye(3).flatten()
    info.p = np.hstack([k, np.zeros((3, 1))]).reshape(-1)
    node.publish('camera_info', info)
    return to_image(grey, 'mono8', msg.header)


def show(node, msg):
    grey = to_array(msg)
    mean, std = grey.mean(), grey.std()
    node.logger.info(f'{msg.width}x{msg.height} {mean:.1f} +- {std:.1f}', throttle_duration_sec=1, skip_first=True)
