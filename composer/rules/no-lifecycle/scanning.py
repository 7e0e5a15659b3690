def configure(node):
    node.logger.info('the motor turns')


def locate(node):
    return {}
