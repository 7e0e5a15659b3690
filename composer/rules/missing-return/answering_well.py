def answer(node, request):
    if node.parameters.enabled:
        return {'success': True, 'message': 'done'}
    return {'success': False, 'message': 'disabled'}
