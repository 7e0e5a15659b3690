def hear(node, message):
    node.logger.info(str(message.data))
