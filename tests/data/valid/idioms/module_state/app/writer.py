from app import config


def start(node):
    config.values = []
    node.state.n = config.LIMIT


def write(node):
    node.state.n -= 1
    config.values.append(node.state.n)
    return node.state.n % config.MAXIMUM
