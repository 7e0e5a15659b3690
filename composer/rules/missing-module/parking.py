try:
    from driving_parts import steering
except ImportError:
    steering = None


def steer(node):
    if steering:
        steering.turn(node, 90)
