import contextlib
import itertools
import json

from composer import CallTimeoutError, ServiceNotAvailableError


class OrderError(ValueError):
    def __init__(self, order, *, hint=''):
        super().__init__(order, hint)
        self.order, self.hint = order, hint


ORDERS = itertools.cycle(['{"go": 1}', '{"go": "x"}', '{', '[]', '{"stop": 0}'])


def order(node):
    return next(ORDERS)


def _obey(text):
    try:
        data = json.loads(text)
        return {k: float(v) for k, v in data.items()}
    except json.JSONDecodeError as error:
        raise OrderError(text, hint=error.msg) from error
    except AttributeError:
        raise OrderError(text) from None


def obey(node, message):
    result = None
    try:
        result = _obey(message.data)
    except* OrderError as group:
        for error in group.exceptions:
            node.state.errors += 1
            result = error.hint or error.order
    except* ValueError as group:
        node.state.errors += len(group.exceptions)
        result = 'value'
    return str(result)


def parse(node, request):
    with contextlib.ExitStack() as stack:
        stack.callback(setattr, node.state, 'parsed', True)
        stack.enter_context(contextlib.suppress(OrderError))
        _obey('{')
    return {'success': node.state.parsed, 'message': f'{node.state.errors} errors'}


def call(node):
    for client, timeout in (('missing', 0.1), ('parse', 2)):
        try:
            response = node.call(client, {}, timeout=timeout)
        except (ServiceNotAvailableError, CallTimeoutError) as error:
            node.logger.info(f'{client}: {type(error).__name__}', once=True)
        else:
            node.logger.info(response.message)
