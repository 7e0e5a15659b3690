def switch(node, request):
    node.state.on = request.data
    return {'success': True}


def turn_on(node):
    node.call(node.parameters.asked, True)
