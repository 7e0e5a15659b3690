def switch(node, request):
    node.state.on = request.data
    return {'success': True}


async def turn_on(node):
    await node.call_async('switch', True)
