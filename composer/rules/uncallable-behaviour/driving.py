SPEED = 3


def start(node):
    node.state.speed = SPEED
