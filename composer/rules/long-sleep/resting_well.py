def rest(node):
    for _ in range(30):
        yield
    node.logger.info('rested')
