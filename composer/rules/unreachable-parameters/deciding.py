def decide(node, changes):
    return 'no negative speed' if changes.get('speed', 0) < 0 else None
