def drive(node):
    node.set_parameters(node.name, {'limit': 0.5})
    node.publish('speed', node.parameters.limit)
