import contextlib


class Client:
    def __init__(self, node):
        self.node, self.calls = node, 0

    async def __aenter__(self):
        return self

    async def __aexit__(self, kind, *_):
        self.node.state.log.append(self.calls)
        return False

    async def add(self, a, b=1):
        self.calls += 1
        return (await self.node.call_async('add', {'int64_value': a, 'int32_value': b})).int64_value


@contextlib.asynccontextmanager
async def client(node):
    async with Client(node) as it:
        yield it


async def add(node, request):
    return {'int64_value': request.int64_value + request.int32_value}


async def one(node):
    async with client(node) as c:
        return await c.add(1, b=2)


async def _sums(c, n):
    for i in range(n):
        yield await c.add(i, i)


async def many(node):
    async with Client(node) as c:
        values = [s async for s in _sums(c, 4) if s]
        values += [await c.add(v) for v in values]
    return {'data': values}


async def stream(node):
    async with client(node) as c:
        async for value in _sums(c, 6):
            yield value if value != 4 else None


async def on_sum(node, message):
    return f'{message.data}' if await _is_even(message.data) else None


async def _is_even(n):
    return n % 2 == 0


async def bye(node):
    node.logger.info(f'{len(node.state.log)} blocks')
