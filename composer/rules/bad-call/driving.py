def drive(node):
    node.publish('speed', data=1.0)
