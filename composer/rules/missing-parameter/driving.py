def drive(node):
    slip = node.parameters.get('slip') or 0.0
    node.state.distance += node.parameters.speed * (1 - slip)
