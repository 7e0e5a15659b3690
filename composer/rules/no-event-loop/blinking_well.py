def blink(node):
    while True:
        node.logger.info('on')
        yield
        node.logger.info('off')
        yield
