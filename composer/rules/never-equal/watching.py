def watch(node, message):
    if message.level == 2:
        node.logger.error(message.message)
