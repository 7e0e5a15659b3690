def turn(node, goal):
    return {}
