import itertools

_total = 0
_seen: list = []


def _make_counter(start, step=1):
    value = start - step

    def count(node):
        nonlocal value
        value += step
        return value

    count.reset = lambda: None
    return count


tick = _make_counter(0)
tock = _make_counter(-5, step=2)


def accumulate(node, message):
    global _total
    _total += message.data
    _seen.append(message.data)
    return _total


def _primes():
    found = []
    for n in itertools.count(2):
        if all(n % p for p in found):
            found.append(n)
            yield n


def sieve(node, primes=_primes()):
    for prime in itertools.islice(primes, 100):
        node.state.prime = prime
        if prime > 10:
            _report(node)
        yield


def _report(node):
    if 'announced' not in vars(node.state):
        node.state.announced = True
        node.logger.info(f'{node.state.prime} is prime')


def summary(node):
    node.logger.info(f'{_total=} {len(_seen)=} {node.state.prime=}')
    del node.state.prime
