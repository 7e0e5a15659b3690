from importlib import import_module


def prepare(node):
    initial = {'values': [], 'dropped': 0, 'reader': import_module('app.reader')}
    for item in initial.items():
        setattr(node.state, *item)
    node.state.helper = lambda: len(node.state.values)
