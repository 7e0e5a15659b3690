import copy


def binary(cell, threshold, keep_unknown):
    if cell < 0 and keep_unknown:
        return -1
    return 100 if cell > threshold else 0


def hear(node, message):
    parameters = node.parameters
    filtered = copy.copy(message)
    filtered.data = [
        binary(cell, parameters.threshold, parameters.keep_unknown) for cell in message.data
    ]
    node.state.last = filtered
    taken = sum(cell == 100 for cell in filtered.data)
    size = message.info.width * message.info.height
    if size:
        node.publish('share', taken / size)
    return filtered


def get(node, request):
    if node.state.last is None:
        raise RuntimeError('there is no map yet')
    return {'map': node.state.last}
