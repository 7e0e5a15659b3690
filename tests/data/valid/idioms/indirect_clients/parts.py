class Proxy:
    def __init__(self, node):
        self._node = node

    def __getattr__(self, name):
        return lambda **request: self._node.call(name, request)


def serve(node, request, text):
    return {'success': True, 'message': text}


def flip(node, request):
    return {'success': not request.data, 'message': 'flipped'}


def proxies(node):
    proxy = Proxy(node)
    return proxy.one().message + proxy.three(data=False).message


def table(node):
    calls = {'two': {}, 'three': {'data': True}}
    answers = {name: node.call(name, payload, timeout=2) for name, payload in calls.items()}
    return ' '.join(a.message for a in answers.values() if hasattr(a, 'message'))


async def coroutine(node):
    pending = [node.call_async(name, {}) for name in ('one', 'two')]
    return ''.join([(await p).message for p in pending])
