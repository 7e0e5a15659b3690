def drive(node):
    {'data': 1.0}
