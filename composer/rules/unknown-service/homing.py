def reset(node, request):
    return {'success': True}
