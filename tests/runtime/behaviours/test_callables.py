"""How a behaviour runs, however it is wrapped."""

from functools import partial, wraps

import pytest

from composer.python_source.function_kinds import FunctionKind
from composer.runtime.behaviours.callables import kind_of


def plain(node):
    pass


def generator(node):
    yield


async def coroutine(node):
    pass


async def async_generator(node):
    yield


KINDS = [
    (plain, FunctionKind.PLAIN),
    (generator, FunctionKind.GENERATOR),
    (coroutine, FunctionKind.COROUTINE),
    (async_generator, FunctionKind.ASYNC_GENERATOR),
]


def decorated(function):
    @wraps(function)
    def wrapper(*arguments):
        return function(*arguments)

    return wrapper


class Callable:
    async def __call__(self, node):
        pass


@pytest.mark.parametrize(('function', 'kind'), KINDS)
def test_decorators_and_given_arguments_change_no_kind(function, kind):
    assert kind_of(function) is kind
    assert kind_of(decorated(function)) is kind
    assert kind_of(partial(function, None)) is kind
    assert kind_of(partial(decorated(function), None)) is kind


def test_an_object_runs_as_its_call_does():
    assert kind_of(Callable()) is FunctionKind.COROUTINE
    assert kind_of(partial(Callable(), None)) is FunctionKind.COROUTINE
