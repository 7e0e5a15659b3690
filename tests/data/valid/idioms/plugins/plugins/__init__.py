import importlib
import pkgutil

REGISTRY = {}


def register(cls):
    REGISTRY[cls.__name__.lower()] = cls
    return cls


def load(node):
    available = {m.name for m in pkgutil.iter_modules(__path__)}
    for name in node.parameters.plugins:
        if f'plugin_{name}' in available:
            importlib.import_module(f'.plugin_{name}', __package__)
    node.state.instances = {name: cls(node) for name, cls in REGISTRY.items()}


def tick(node):
    for name, plugin in node.state.instances.items():
        if (value := plugin()) is not None:
            node.publish(name, value)


def loaded(node):
    first = node.state.instances[node.parameters.selected]
    return f'{type(first).__qualname__} of {len(node.state.instances)}'


def on_ramp(node, message):
    node.state.instances['ramp'].feedback = message.data
