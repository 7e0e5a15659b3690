def drive(node):
    return {'data': node.parameters.limit}
