def drive(node):
    node.set_parameters('motro', {'limit': 0.5})
