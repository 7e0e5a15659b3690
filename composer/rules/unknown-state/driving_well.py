def drive(node):
    node.state.distance += 0.5
    node.publish('speed', node.state.distance)
