from composer import CallTimeoutError, ServiceNotAvailableError


def add(node, request, *, scale):
    return {'int64_value': scale * request.int64_value + request.int32_value}


async def add_async(node, request, *, scale):
    return dict(int64_value=scale * request.int64_value)


async def warm_up(node):
    for client in ('add_a', 'add_b'):
        try:
            node.state.answers[client] = await _ask(node, client, 1)
        except (ServiceNotAvailableError, CallTimeoutError) as error:
            node.logger.info(f'{client}: {error}')


async def _ask(node, client, value, **more):
    response = await node.call_async(client, {'int64_value': value, **more}, timeout=2.0)
    return response.int64_value


async def number(node):
    node.own_state['n'] = n = node.own_state.get('n', -1) + 1
    return n


async def on_number(node, message):
    if message.data % 2:
        return None
    return await _ask(node, f'add_{"ab"[message.data % 4 // 2]}', message.data, int32_value=1)


async def both(node):
    while True:
        first = await _ask(node, 'add_a', 1)
        second = await _ask(node, 'add_b', first)
        yield first + second
