def drive(node):
    return {'data': 1.0}
