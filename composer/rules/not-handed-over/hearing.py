def hear(node, words):
    node.logger.info(words.data)
