from functools import partial
from operator import methodcaller


def partials(node):
    say = partial(node.publish, 'a')
    say('hello')
    say(payload={'data': 'world'})


class Output:
    def __init__(self, publish, name):
        self._publish, self._name = publish, name

    def __lshift__(self, value):
        self._publish(self._name, value)
        return self


def methods(node):
    Output(node.publish, 'b') << 'one' << 'two'
    methodcaller('publish', 'c', 'three')(node)
    getattr(node, 'pub' + 'lish')('d', 'four')


def passed(node, publisher):
    for text in map('{}!'.format, range(2)):
        node.publish(publisher, text)


def star(node):
    outputs = [('f', 'x'), ('a', {'data': 'y'})]
    for output in outputs:
        node.publish(*output)
    node.publish(**{'name': 'f', 'payload': 'z'})
