def decide(node, changes):
    return None if changes['limit'] < 2.0 else 'too fast'
