def anything(*args, **kwargs):
    node, *rest = args
    if not rest:
        return node.parameters.gain
    message, = rest
    return message.data * kwargs.get('factor', 2)


def keywords(node, message, **options):
    offset, scale = (options.pop(name, default) for name, default in (('offset', 0), ('scale', 1)))
    for name, value in options.items():
        node.own_state[name] = value
    return offset + scale * message.data


def strict(node, message, /, *, limit, signs=(-1, 1)):
    low, high = (s * limit for s in signs)
    return min(max(message.data, low), high)


def defaults(node, word='one', times=1, *more, sep=' ', _cache={}):
    key = word, times
    if key not in _cache:
        _cache[key] = sep.join([word] * times + list(more))
    return _cache[key]
