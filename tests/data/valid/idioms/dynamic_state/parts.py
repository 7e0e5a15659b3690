import types


def prepare(node):
    for i in range(2, node.parameters.count):
        setattr(node.state, f'wheel_{i}', 0.0)
    node.state.__setattr__('ready', True)
    node.state.nested = types.SimpleNamespace(hits=0)


def spin(node):
    values = vars(node.state)
    if not values.get('ready'):
        return
    for i in range(node.parameters.count):
        values[f'wheel_{i}'] += node.state.offsets[i]
    low, high = (node.state.limits[k] for k in ('low', 'high'))
    wrapped = {k: low + (v - low) % (high - low) for k, v in values.items() if k.startswith('wheel_')}
    values.update(wrapped)
    return {'name': list(wrapped), 'position': [*wrapped.values()]}


def check(node, message):
    state = node.state
    for name, position in zip(message.name, message.position):
        if abs(getattr(state, name) - position) < 1e-6:
            state.nested.hits += 1
    last = getattr(state, 'wheel_%d' % (len(message.name) - 1))
    return last + state.wheel_2 + state.wheel_3
