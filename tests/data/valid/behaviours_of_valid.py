"""Behaviours that the valid files name, in every shape that can be bound."""

import functools
from json import dumps


class Counter:
    def __init__(self, node=None):
        self.node = node

    def __call__(self, node):
        return 1


def plain(node):
    return None


def generator(node):
    yield 'one'


async def coroutine(node):
    return None


async def async_generator(node):
    yield 'one'


def with_arguments(node, /, speed, *, heading=0.0, **others):
    return speed


def anything(*args, **kwargs):
    return dumps(args)


def hear(node, message, repeat=1):
    return message


def spell(node, message):
    return str(message.data)


async def hear_later(node, message):
    return message


def decide(node, changes):
    return None


@functools.cache
def decorated(node):
    return None


short = lambda node: None  # noqa: E731
bound = functools.partial(with_arguments, speed=1)
counter = Counter()
