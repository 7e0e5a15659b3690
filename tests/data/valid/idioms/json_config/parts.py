import json
from types import SimpleNamespace


def load(node):
    node.state.config = json.loads(node.parameters.config, object_hook=lambda d: SimpleNamespace(**d))
    node.state.values = {n: getattr(node.state.config.outputs, n).start for n in node.parameters.output_names.split(',')}


def run(node):
    for name, value in node.state.values.items():
        node.publish(name, value)
        node.state.values[name] += vars(node.state.config.outputs)[name].step


def on_value(node, message, name):
    unit = getattr(node.state.config.unit, name, None)
    return unit and f'{message.data:.1f} {unit}'
