def drive(node):
    node.state.distance += 0.1
