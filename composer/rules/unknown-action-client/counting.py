def start(node):
    node.send_goal('count', 5)


def start_again(node):
    node.send_goal('cont', 5)
