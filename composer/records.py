"""Records: data classes that are defined in a fifth of the time.

Before Python 3.13, `dataclass(frozen=True)` compiles six methods of each class, one by one. For
the hundred records of a check, that took a third of its time.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from operator import attrgetter
from typing import TYPE_CHECKING, Any, TypeVar, cast, dataclass_transform

if TYPE_CHECKING:
    from collections.abc import Callable

RecordT = TypeVar('RecordT')


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def record(cls: type[RecordT]) -> type[RecordT]:
    """Make a class a data class with slots, compared by its values, which nobody may change.

    That nobody changes them is left to type checkers. A class with cached properties gets no
    slots, as these keep their values in its `__dict__`.
    """
    has_cache = any(isinstance(each, cached_property) for each in vars(cls).values())
    made: Any = dataclass(slots=not has_cache, eq=False, repr=False)(cls)
    names = [each.name for each in fields(made) if each.compare]
    values: Callable[[Any], object] = attrgetter(*names) if names else lambda _: ()

    def is_equal(self: Any, other: Any) -> Any:
        is_same = other.__class__ is self.__class__
        return values(self) == values(other) if is_same else NotImplemented

    made.__eq__ = is_equal
    made.__hash__ = lambda self: hash(values(self))
    made.__repr__ = _represent
    return cast('type[RecordT]', made)


def _represent(self: Any) -> str:
    shown = (f'{each.name}={getattr(self, each.name)!r}' for each in fields(self) if each.repr)
    return f'{type(self).__qualname__}({", ".join(shown)})'
