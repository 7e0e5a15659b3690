import time


def rest(node):
    time.sleep(30)
    node.logger.info('rested')
