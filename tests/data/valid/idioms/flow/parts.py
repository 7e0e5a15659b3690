from typing import NoReturn

DEBUG = False


def _fail(reason) -> NoReturn:
    raise RuntimeError(reason)


def try_it(node):
    attempt = value = None
    try:
        node.state.attempts += 1
        if node.state.attempts % 3 == 0:
            _fail('every third')
        value = 100 // (node.state.attempts % 5)
    except ZeroDivisionError:
        value = -1
    except RuntimeError as error:
        node.logger.debug(f'{error}')
        return None
    else:
        attempt = value
    finally:
        node.state.last = attempt
    while value > 10:
        value //= 2
        if value == 12:
            continue
        if value == 25:
            break
    else:
        value += 1
    return value


def classify(node, message):
    if DEBUG:
        return message.no_such_field
    if message.data < 0:
        phase = 'negative'
    elif message.data == 0:
        return
    else:
        for limit, phase in ((5, 'small'), (10, 'middle'), (float('inf'), 'large')):
            if message.data < limit:
                break
    if node.parameters.strict:
        _fail(phase)
        node.publish('nowhere', phase)
    return phase


def debug(node):
    if not hasattr(node.state, 'last'):
        return None
    try:
        text = f'{node.state.last:d}'
    except (TypeError, AttributeError):
        text = 'none'
    return text if __debug__ else node.state.never_set
