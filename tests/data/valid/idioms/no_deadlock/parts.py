import threading


def quick(node, request):
    return {'success': True, 'message': node.name}


def ask(node, name):
    return node.call(name, {}).message


def ask_same(node):
    return node.call('same', {}).message


def ask_later(node):
    thread = getattr(node.state, 'thread', None)
    if thread is None or not thread.is_alive():
        node.state.thread = threading.Thread(target=_ask, args=(node,), daemon=True)
        node.state.thread.start()


def _ask(node):
    try:
        node.state.answer = node.call('same', {}, timeout=1.0)
    except Exception as error:
        node.state.answer = error
