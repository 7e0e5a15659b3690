from geometry_msgs.msg import Point as P, Point


class Scope:
    for _i in range(3):
        locals()[f'v{_i}'] = _i * 10
    total = sum([v0, v1, v2])  # noqa: F821
    del _i

    class Inner:
        names = tuple('xyz')


def make_i(node):
    node.state.n += 1; n = node.state.n
    if n % 2: return n if n < 5 else -n
    elif not n % 4: return None
    return Scope.total


def make_p(node):
    p = P()
    p.x, (p.y, p.z) = 1.0, (2.0, 3.0)
    p.x += 1; p.y -= p.x; p.z **= 2
    p.x = p.y = -p.z
    [p.x, p.y] = p.y, p.x
    for p.x in (0.5, 1.5):
        pass
    with _value(4.0) as p.y:
        pass
    values = {name: getattr(p, name) for name in Scope.Inner.names}
    assert (p.x == 1.5 and p.y == 4) is not False, values
    first, *middle, last = *values.values(), 0
    return Point(**{**values, 'z': float(first if last else middle[-1])})


class _value:
    def __init__(self, value): self.value = value
    def __enter__(self): return self.value
    def __exit__(self, *exc): return None


def make_s(node):
    a, (b0, *b), c = (node.parameters[k] for k in 'abc')
    text = (f'{a:>{b0 + 2}}' f'{c!r:.3}' '%s' % (len(b),)
            if 0 < a < 2 <= len(b) != 5 else '')
    node.state.m |= {a: text, **{str(k): k for k in b}}
    node.state.m['c'], node.state.m['d'] = c, node.state.m.get('d', [])
    node.state.m['d'][len(node.state.m['d']):] = [c][:1]
    del node.state.m['d'][:-3]
    return (lambda *args, sep='': sep.join(args))(text, c, sep='-')


def on_i(node, message):
    def describe(value=message.data):
        nonlocal seen
        seen += 1
        return 'negative' if value < 0 else 'big' if value > 20 else 'small'
    seen = 0
    result = [describe() for _ in range(2)] and describe
    return result() + str(seen) if seen == 2 else ...
