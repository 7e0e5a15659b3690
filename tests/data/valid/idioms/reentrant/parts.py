import threading
import time
from concurrent.futures import ThreadPoolExecutor

LOCK = threading.Lock()
ACTIVE = {'now': 0, 'most': 0}


class _Active:
    def __enter__(self):
        with LOCK:
            ACTIVE['now'] += 1
            ACTIVE['most'] = max(ACTIVE.values())

    def __exit__(self, *_):
        with LOCK:
            ACTIVE['now'] -= 1


def slow(node, request):
    with _Active():
        time.sleep(0.05)
        with ThreadPoolExecutor(2) as pool:
            total = sum(pool.map(abs, range(-3, 3)))
    return {'success': True, 'message': str(total)}


def nested(node, request):
    answer = node.call('slow', {}, timeout=3.0)
    return {'success': answer.success, 'message': f'nested {answer.message}'}


def status(node):
    node.state.most = ACTIVE['most']
    event = threading.Event()
    worker = threading.Timer(0.001, event.set)
    worker.start()
    assert event.wait(1.0)


def ask(node, name):
    answer = node.call(name, {})
    node.logger.debug(answer.message)
