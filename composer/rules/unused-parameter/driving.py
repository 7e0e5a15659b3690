def drive(node):
    node.state.distance += node.parameters.speed
