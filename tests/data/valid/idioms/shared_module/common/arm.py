def setup(node, gain, **initial):
    node.state.gain = gain
    for name in initial:
        setattr(node.state, name, initial[name])


def move(node):
    mirrored = 'mirror' in node.parameters and node.parameters.mirror
    node.state.angle += node.state.gain * 0.1
    return -node.state.angle if mirrored and node.parameters.side == 'right' else node.state.angle
