import itertools
import re

EVENTS = itertools.cycle(['button_press', 'button-release', 'dial 3', 'unknown', 'dial -2'])


def press(node):
    return next(EVENTS)


class Panel:
    outputs = {'led': bool, 'count': int, 'beep': abs}

    def __init__(self, node):
        self.node = node
        self.values = {name: kind() if kind is not abs else 0 for name, kind in self.outputs.items()}

    def on_button_press(self):
        self.led = True

    def on_button_release(self):
        self.led = False

    def on_dial(self, amount):
        self.count = self.values['count'] + int(amount)
        self.beep = abs(int(amount)) * 100

    def __setattr__(self, name, value):
        if name in type(self).outputs:
            self.values[name] = value
            self.node.publish(name, value)
        else:
            super().__setattr__(name, value)

    def handle(self, text):
        name, *arguments = re.sub('-(?=[a-z])', '_', text).split()
        method = getattr(self, f'on_{name}', None)
        if callable(method):
            method(*arguments)


def dispatch(node, message):
    if not hasattr(node.state, 'panel'):
        node.state.panel = Panel(node)
    node.state.panel.handle(message.data)
