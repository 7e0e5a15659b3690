import functools
import inspect


def collect(generator):
    """Make a payload of what a generator yields."""
    @functools.wraps(generator)
    def wrapper(*args, **kwargs):
        return {'data': list(generator(*args, **kwargs))}
    return wrapper


def inject(**factories):
    def decorate(function):
        def wrapper(node, message):
            return function(node, message, **{name: make(node) for name, make in factories.items()})
        return wrapper
    return decorate


def fields(function):
    names = [n for n in inspect.signature(function).parameters if n != 'node']

    def wrapper(node, message, **constants):
        values = {n: constants[n] if n in constants else getattr(message, n) for n in names}
        return function(node, **values)
    return wrapper


@collect
def collected(node, message):
    for i in range(min(message.data, 5)):
        yield i


@inject(limit=lambda node: node.parameters.limit, own=lambda node: node.own_state)
def injected(node, message, limit, own):
    own['count'] = own.get('count', 0) + 1
    return f'{own["count"]} {min(limit, message.data)}'


@fields
def unpacked(node, data):
    return str(data)


@fields
def only_data(node, data, suffix):
    return f'{data}{suffix}'


def inner_generator(node, message):
    def divisors():
        for i in range(1, message.data):
            if not message.data % i:
                yield i
    squares = (i * i for i in divisors())
    return {'data': [*squares]}


def drained(node):
    steps = node.own_state.get('steps')
    if steps is None:
        steps = node.own_state['steps'] = _steps()
    return next(steps, None)


def _steps():
    yield from 'abc'


class Counter:
    def __init__(self):
        functools.update_wrapper(self, Counter.__call__)
        self.n = 0

    def __call__(self, node):
        self.n += 1
        return self.n


counter = Counter()
