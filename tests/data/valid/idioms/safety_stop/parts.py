import copy

import numpy as np
from sensor_msgs.msg import LaserScan, Range
from geometry_msgs.msg import Twist

BEAMS = 180


def fake_scan(node):
    rng = node.own_state.setdefault('rng', np.random.default_rng(4))
    msg = LaserScan(angle_min=-np.pi / 2, angle_max=np.pi / 2, range_min=0.05, range_max=8.0)
    msg.header.frame_id = 'laser'
    msg.header.stamp = node.now().to_msg()
    msg.angle_increment = float(np.pi / BEAMS)
    ranges = rng.uniform(0.3, 9.0, BEAMS).astype(np.float32)
    ranges[rng.integers(0, BEAMS, 5)] = np.inf
    msg.ranges = ranges.tolist()
    return msg


def _front(scan: LaserScan, cone: float) -> np.ndarray:
    ranges = np.asarray(scan.ranges)
    angles = scan.angle_min + np.arange(ranges.size) * scan.angle_increment
    mask = np.abs(angles) < cone / 2
    mask &= np.isfinite(ranges) & (ranges > scan.range_min) & (ranges < scan.range_max)
    return ranges[mask]


def on_scan(node, scan):
    front = _front(scan, np.deg2rad(node.parameters.cone_deg))
    node.state.distance = front.min() if front.size else np.float32(scan.range_max)
    return {
        'header': scan.header,
        'radiation_type': Range.INFRARED,
        'field_of_view': np.deg2rad(node.parameters.cone_deg),
        'min_range': scan.range_min,
        'max_range': scan.range_max,
        'range': node.state.distance,
    }


def gate(node, cmd: Twist):
    if not hasattr(node.state, 'distance'):
        node.logger.info('no scan yet', once=True)
        return None
    stop, slow = (getattr(node.parameters, f'{k}_distance') for k in ('stop', 'slow'))
    safe = copy.deepcopy(cmd)
    if cmd.linear.x > 0:
        scale = np.clip((node.state.distance - stop) / (slow - stop), 0, 1)
        safe.linear.x *= float(scale)
        if not scale:
            node.logger.info('obstacle, stopping', throttle_duration_sec=1.0)
    return safe
