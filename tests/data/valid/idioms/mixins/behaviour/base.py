class ParameterMixin:
    names: tuple = ()

    def __init__(self, node, **kwargs):
        super().__init__(**kwargs)
        self.node = node

    def __getattr__(self, name):
        if name in type(self).names:
            return self.node.parameters[name]
        raise AttributeError(name)


class CountingMixin:
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.counts = {}

    def count(self, key):
        self.counts[key] = self.counts.get(key, 0) + 1


def once(factory):
    """One object for each node, kept in its state."""
    def get(node):
        store = vars(node.state)
        key = f'_{factory.__name__}'
        return store[key] if key in store else store.setdefault(key, factory(node))
    return get
