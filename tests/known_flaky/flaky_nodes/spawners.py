"""A slow manager of controllers, and spawners that all call it at once."""

import time

from composer import CallTimeoutError


def load(node, _request):
    time.sleep(0.2)
    node.state.loaded += 1
    return {'success': True, 'message': f'{node.state.loaded} loaded'}


def switch(node, _request):
    time.sleep(0.5)
    return {'success': True, 'message': f'{node.state.loaded} active'}


def spawn(node):
    """Spawn at the first tick; an attempt that is given up is served all the same, later."""
    for name in ('load', 'switch'):
        if not any(call(node, name) for _ in range(node.parameters.attempts)):
            node.logger.error(f'{name}: gave up')
            break
    else:
        node.logger.info('spawned')
    yield


def call(node, name):
    try:
        return node.call(name, {}, timeout=node.parameters.timeout).success
    except CallTimeoutError:
        node.logger.warning(f'{name}: no answer')
        return False
