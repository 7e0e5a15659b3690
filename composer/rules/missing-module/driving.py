from driving_parts import steering


def steer(node):
    steering.turn(node, 90)
