def _talk(side):
    return lambda node: f'{side} of {node.name}'


globals().update({f'talk_{side}': _talk(side) for side in ('left', 'right')})
