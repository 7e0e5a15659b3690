import math
import statistics as st


def localise(node):
    angle = 2 * math.pi * node.parameters.id / 3 + node.now().nanoseconds * 1e-9
    r = node.parameters.spread
    pose = {'position': {'x': r * math.cos(angle), 'y': r * math.sin(angle)}, 'orientation': {'w': 1}}
    return {'header': {'frame_id': 'map', 'stamp': node.now().to_msg()}, 'pose': pose}


def track(node, message, robot):
    poses = node.state.__dict__.setdefault('poses', {})
    poses[robot] = message.pose
    if len(poses) < node.parameters.robots:
        return None
    points = [(p.position.x, p.position.y) for p in poses.values()]
    x, y = map(st.fmean, zip(*points))
    return {'header': message.header, 'point': {'x': x, 'y': y}}


def count(node):
    return len(getattr(node.state, 'poses', {}))
