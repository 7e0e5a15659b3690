def drive(node):
    while True:
        node.publish('speed', 1.0)
