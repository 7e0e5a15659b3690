import functools
import weakref
from collections import Counter


class TtlCache(dict):
    def __init__(self, node, ttl):
        super().__init__()
        self.clock, self.ttl = node.now, ttl

    def __missing__(self, key):
        self[key] = value = (self.clock().nanoseconds, key ** 2)
        return value

    def fresh(self, key):
        at, value = self[key]
        if self.clock().nanoseconds - at > self.ttl * 1e9:
            del self[key]
            return self.fresh(key)
        return value


_caches = weakref.WeakKeyDictionary()


def _cache(node):
    if node.ros not in _caches:
        _caches[node.ros] = TtlCache(node, node.parameters.ttl)
    return _caches[node.ros]


def lookup(node, request):
    return {'int64_value': _cache(node).fresh(request.int64_value)}


@functools.lru_cache(maxsize=2)
def _squares(call, n):
    return call('lookup', {'int64_value': n}).int64_value


def ask(node):
    counter = vars(node.state).setdefault('counter', Counter())
    n = counter.total() % 5
    counter[n] += 1
    value = _squares(node.call, n)
    counter.update({'sum': 0})
    return value


def hits(node):
    info = _squares.cache_info()
    most = node.state.counter.most_common(1) if hasattr(node.state, 'counter') else []
    return info.hits + sum(n for _, n in most)
