from functools import partial, wraps


def _greet(greeting, node, who, mark='.', times=1):
    return ' '.join([f'{greeting} {who}{mark}'] * times)


hello = partial(_greet, 'hello', who='world')
shout = partial(hello, mark='!')
nested = partial(partial(shout, times=3), who='all')


class Greeter:
    def __init__(self, word):
        self.word = word

    def greet(self, node, /, times, **rest):
        return _greet(self.word, node, rest.pop('who', node.name), times=times)


bound = Greeter('good day').greet


class Speaker(dict):
    """A payload that makes itself."""

    def __init__(self, node):
        super().__init__(data=f'{node.name} speaks')
