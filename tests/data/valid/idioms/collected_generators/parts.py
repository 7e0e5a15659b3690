"""Generator functions whose decorator makes one payload of what they yield."""
import functools


def to(make):
    def decorate(generator):
        def function(*args, **kwargs):
            return make(generator(*args, **kwargs))
        functools.update_wrapper(function, generator, assigned=('__name__', '__doc__'))
        del function.__wrapped__
        return function
    return decorate


def payload(field):
    return lambda items: {field: list(items)}


@to(payload('data'))
def ints(node):
    a, b = 0, 1
    while a < 50:
        yield a
        a, b = b, a + b


@to(max)
def largest(node, message):
    yield 0
    yield from message.data


@to(payload('poses'))
def path(node):
    for i in range(4):
        yield {'pose': {'position': {'x': i}}}


@to(lambda items: {'result': {'names': [*items]}})
def names(node, request):
    for name in ('a', 'b'):
        if not request.prefixes or name in request.prefixes:
            yield name


def ask(node):
    assert node.call('names', {'prefixes': ['b']}).result.names == ['b']
