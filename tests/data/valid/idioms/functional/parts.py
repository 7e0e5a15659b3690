from functools import partial, reduce
from itertools import accumulate, chain, starmap, takewhile
import math
import operator as op

STEPS = {
    'double': partial(op.mul, 2),
    'offset': lambda value, node=None: value + (node.parameters.offset if node else 0),
    'clip': lambda v, /, *, low=-2.0, high=2.0: sorted((low, v, high))[1],
}
compose = lambda *fs: lambda value: reduce(lambda acc, f: f(acc), fs, value)


def raw(node, _clock=lambda node: node.now().nanoseconds / 1e9):
    return math.sin(_clock(node))


def _steps(node):
    for name in node.parameters.chain:
        step = STEPS[name]
        yield partial(step, node=node) if name == 'offset' else step


def process(node, message):
    return compose(*_steps(node))(message.data)


def all_steps(node):
    values = list(accumulate(_steps(node), lambda v, f: f(v), initial=0.5))
    values.extend(starmap(pow, ((2, 0.5), (3.0, 2))))
    values = [*chain(values, takewhile(lambda v: v < 3, map(float, range(9))))]
    return {'data': values}
