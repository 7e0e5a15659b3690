def answer(node, request):
    if node.parameters.enabled:
        return {'success': True, 'message': 'done'}
