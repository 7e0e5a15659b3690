def switch(node, request):
    node.state.on = request.data
    return {'success': True}
