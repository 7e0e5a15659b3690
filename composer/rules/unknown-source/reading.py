def read(node):
    with open(0) as port:
        yield from port
