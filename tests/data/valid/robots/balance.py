import math


def pitch_of(q):
    sine = 2.0 * (q.w * q.y - q.z * q.x)
    return math.asin(max(-1.0, min(1.0, sine)))


def hear(node, message):
    state = node.state
    if not state.is_up:
        return None
    pitch = pitch_of(message.orientation)
    if abs(pitch) > node.parameters.fall_angle:
        state.is_up = False
        node.logger.error(f'fallen at {math.degrees(pitch):.0f} degrees')
        node.publish('fallen', {})
        return 0.0
    stamp = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
    before, state.before = state.before, stamp
    dt = stamp - before if before is not None else 0.0
    state.integral += pitch * dt
    gains = node.parameters('gains')
    rate = message.angular_velocity.y
    return gains['p'] * pitch + gains['i'] * state.integral + gains['d'] * rate


def stand_up(node, request):
    node.state.integral = 0.0
    node.state.is_up = True
    return {}


def check(node, changes):
    for name, value in changes.items():
        if name.startswith('gains.') and value < 0:
            return f'{name} must not be negative'
    return None
