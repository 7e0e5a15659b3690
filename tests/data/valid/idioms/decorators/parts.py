import contextlib
import functools
import time


def counted(function):
    @functools.wraps(function)
    def wrapper(node, *args, **kwargs):
        node.state.calls += 1
        return function(node, *args, **kwargs)
    return wrapper


def timed(name):
    def decorate(function):
        @functools.wraps(function)
        def wrapper(*args, **kwargs):
            with _stopwatch(args[0], name):
                return function(*args, **kwargs)
        return wrapper
    return decorate


@contextlib.contextmanager
def _stopwatch(node, name):
    start = time.perf_counter()
    try:
        yield
    finally:
        node.publish(name, time.perf_counter() - start)


@functools.lru_cache
def _table(n):
    return [i * i for i in range(n)]


@counted
@timed('times')
def produce(node):
    return _table(10)[node.state.calls % 10]


@counted
def listen(node, message):
    with contextlib.suppress(AttributeError):
        if node.state.best >= message.data:
            return
    node.state.best = message.data


@timed('times')
@counted
def compute(node, request):
    return {'success': True, 'message': f'{node.state.calls} calls, best {getattr(node.state, "best", None)}'}


@counted
async def ask(node):
    if not node.parameters.simulate:
        return
    response = await node.call_async('compute', {})
    node.logger.info(response.message)
