import math
import operator
from collections import deque
from functools import partialmethod
from operator import attrgetter


class MovingAverage:
    def __init__(self, size=5, field='data'):
        self.window = deque(maxlen=size)
        self.get = attrgetter(field)

    def __call__(self, node, message):
        self.window.append(self.get(message))
        return sum(self.window) / len(self.window)


class Text:
    VERSION = (1, 2)

    @staticmethod
    def static(node):
        return f'{node.name} {node.parameters.gain:g}'

    @classmethod
    def of_class(cls, node):
        return '.'.join(map(str, cls.VERSION))

    def _say(self, node, word):
        return word.upper()

    hello = partialmethod(_say, word='hello')


def _apply(node, message, function, /, *arguments):
    return function(message.data, *arguments)


average = MovingAverage(size=3)
square = lambda node, message: _apply(node, message, operator.pow, 2)
scaled = lambda node, message: message.data * node.parameters.gain
source = lambda node: math.sin(node.now().nanoseconds * 1e-9)
label = Text.static
version = Text.of_class
alias = Text().hello
