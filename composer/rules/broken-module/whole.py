def start(node):
    return 3
