"""A talker, a listener, and a bridge that changes what passes between them."""


def talk(node):
    node.state.count += 1
    return f'Hello World: {node.state.count}'


def change(_node, message):
    return message.data.replace('Hello', 'Aloha')


def listen(node, message):
    node.logger.info(f'I heard: [{message.data}]')
