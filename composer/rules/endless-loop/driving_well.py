def drive(node):
    node.publish('speed', 1.0)
