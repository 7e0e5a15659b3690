"""Decorators that keep the name of a function with wraps, but change what it is called with."""
from functools import wraps


def without_message(function):
    @wraps(function)
    def callback(node, message):
        return function(node)
    return callback


def with_logger(function):
    @wraps(function)
    def callback(node, message):
        return function(node, message, logger=node.logger)
    return callback


def skipping(function):
    @wraps(function)
    def callback(node, message, every):
        count = node.own_state['count'] = node.own_state.get('count', 0) + 1
        return None if count % every else function(node, message)
    return callback


def service(*names, answer):
    def decorate(function):
        @wraps(function)
        def callback(node, request):
            return {answer: function(*(getattr(request, n) for n in names))}
        return callback
    return decorate


@without_message
def touched(node):
    node.state.touched = node.now()


@with_logger
def logged(node, message, logger):
    logger.debug(f'{message.data}')
    return f'{message.data}'


@skipping
def every_third(node, message):
    return 'third'


@service('int32_value', 'int64_value', answer='int64_value')
def add(a, b):
    return a + b


def make(node):
    return getattr(node.state, 'touched', node.now()).nanoseconds % 100


def ask(node):
    assert node.call('sum', {'int32_value': 2, 'int64_value': 3}).int64_value == 5
