def repeat(node, message):
    yield message


def turn(node):
    for heading in range(360):
        node.state.heading = heading
        yield
