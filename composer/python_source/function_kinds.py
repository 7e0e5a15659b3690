"""What kinds of functions there are."""

from __future__ import annotations

from enum import Enum


class FunctionKind(Enum):
    """What a call of a function returns: a value, a generator or a coroutine."""

    PLAIN = 'function'
    GENERATOR = 'generator function'
    COROUTINE = 'async function'
    ASYNC_GENERATOR = 'async generator function'

    @property
    def is_generator(self) -> bool:
        """Whether it yields."""
        return self in (FunctionKind.GENERATOR, FunctionKind.ASYNC_GENERATOR)
