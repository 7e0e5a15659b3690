DEFAULTS = {'battery': 1.0, 'goal': None, 'ticks': 0}


def initialise(node):
    node.state.__dict__.update(DEFAULTS)
    remember(node, charging=False)


def remember(node, **values):
    for name, value in values.items():
        setattr(node.state, name, value)


def recall(node, name, default=None):
    return getattr(node.state, name, default)
