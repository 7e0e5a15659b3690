def collect(node, message, key):
    vars(node.state)[key] = message.data


def total(node):
    if not all(hasattr(node.state, k) for k in ('left', 'right')):
        return None
    return node.state.left + node.state.right
