WINDOW = 10


def read(node, message):
    node.state.values.append(message.data)
    while node.state.helper() > node.state.reader.WINDOW:
        node.state.values.pop(0)
        node.state.dropped += 1


def mean(node):
    values = node.state.values
    return values and sum(values) / len(values) or None
