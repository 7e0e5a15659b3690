def start(node):
    node.state.speed = 1


def obey(node, message):
    node.state.order = message.data
