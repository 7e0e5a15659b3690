def decide(node, changes):
    return changes['limit'] < 2.0
