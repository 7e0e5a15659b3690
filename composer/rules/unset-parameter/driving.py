def drive(node):
    node.parameters.limit = 0.5
    node.publish('speed', node.parameters.limit)
