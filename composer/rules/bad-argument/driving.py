def steer(node, heading):
    node.state.heading = heading
