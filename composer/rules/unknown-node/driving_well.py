def drive(node):
    node.set_parameters('motor', {'limit': 0.5})
