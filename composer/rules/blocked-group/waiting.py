import threading

GO = threading.Event()


def go(node, message):
    GO.set()


def start(node):
    GO.wait()
    node.logger.info('gone')
