def shine(node):
    return node.parameters.brightness


def log_changes(node, changes):
    for name, value in changes.items():
        before = node.parameters.get(name)
        node.logger.debug(f'{name}: {before} -> {value}')
    if 'colour' in changes and changes['colour'] not in {'warm', 'cold'}:
        return f'no colour {changes["colour"]!r}'


def dim(node, target):
    level = node.get_parameters(target, ['brightness'])['brightness']
    node.set_parameters(target, {'brightness': (level + node.parameters.step) % 101} | ({'colour': 'cold'} if level > 50 else {}))


def read(node):
    values = node.get_parameters('/house/lamp', [n for n in ('colour', 'scenes')])
    colour, scenes = values.values()
    node.logger.info(f'{colour} {", ".join(scenes)}')
