def now(node):
    return node.now().nanoseconds * 1e-9


def feet(node, create=dict):
    try:
        return node.state.feet
    except AttributeError:
        node.state.feet = create()
        return node.state.feet
