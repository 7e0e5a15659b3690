def watch(node, message):
    if message.level == message.ERROR:
        node.logger.error(message.message)
