import random

from rclpy.time import Time
from std_msgs.msg import Header

DEVICE = f'{random.getrandbits(16):04x}'


def ping(node):
    sequence = node.own_state['sequence'] = node.own_state.get('sequence', 0) + 1
    header = Header(frame_id=f'{sequence}_{DEVICE}')
    header.stamp = node.now().to_msg()
    waiting = vars(node.state).setdefault('waiting', {})
    waiting[header.frame_id] = header.stamp
    while len(waiting) > 10:
        del waiting[min(waiting, key=lambda k: int(k.split('_')[0]))]
    return header


def on_ping(node, header):
    return header if header.frame_id.endswith(DEVICE) else None


def on_pong(node, header):
    if (sent := node.state.waiting.pop(header.frame_id, None)) is None:
        return
    clock_type = node.now().clock_type
    rtt = node.now() - Time.from_msg(sent, clock_type=clock_type)
    node.state.pongs = getattr(node.state, 'pongs', 0) + 1
    return rtt.nanoseconds / 1e6
