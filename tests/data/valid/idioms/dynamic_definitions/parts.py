def _on(name):
    def callback(node, message):
        heard = vars(node.state).setdefault('heard', {})
        heard[name] = message.data
    callback.__name__ = f'on_{name}'
    return callback


for _name in 'abc':
    globals()[f'on_{_name}'] = _on(_name)


def _constants(*values):
    for value in values:
        yield lambda node, value=value: value


make_a, make_b = _constants('first', 'second')
[make_c] = [lambda node: 3]
