from std_srvs.srv import SetBool, Trigger, Empty


def switch(node, request: SetBool.Request, room: str) -> SetBool.Response:
    before, node.state.lights[room] = node.state.lights[room], request.data
    node.state.log.append((room, request.data))
    response = SetBool.Response()
    response.success = before != request.data
    response.message = f'{room} {"on" if request.data else "off"}' if response.success else 'no change'
    node.publish('lights', {'data': [int(v) for v in node.state.lights.values()]})
    return response


def all_off(node, request, /):
    lit = [room for room, on in node.state.lights.items() if on]
    node.state.lights.update(dict.fromkeys(lit, False))
    return Trigger.Response(success=bool(lit), message=', '.join(lit))


def reset(node, _):
    node.state.log.clear()
    return Empty.Response()


SCRIPT = [('kitchen', True), ('hall', True), ('kitchen', True), ('all_off', None), ('hall', False)]


def play(node):
    for name, value in SCRIPT:
        request = {} if value is None else value
        response = node.call(name, request)
        node.logger.info(f'{name}: {response.success} {response.message}')
        yield


async def clean(node):
    response = await node.call_async('reset', Empty.Request())
    assert isinstance(response, Empty.Response)
