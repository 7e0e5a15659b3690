"""Calls that make arrays of numbers, of NumPy and of `array`: what they hold, and how many."""

from __future__ import annotations

from functools import partial
from math import prod
from typing import TYPE_CHECKING

from composer.inference.evaluation.library.known_values import Computation, NotKnownError
from composer.inference.evaluation.part import Part
from composer.inference.values import (
    UNKNOWN,
    Arguments,
    ArrayField,
    Constant,
    External,
    Place,
    Scalar,
    Sequence,
    Unknown,
    Value,
    alternatives,
    chosen_by,
)
from composer.interfaces.descriptions import FieldType

if TYPE_CHECKING:
    from collections.abc import Callable

_FLOAT, _WHOLE = 'float64', 'int64'
_OF_PYTHON = {'float': _FLOAT, 'int': _WHOLE, 'bool': 'bool', 'bool_': 'bool', 'float16': _FLOAT}
_KINDS = {'float32', _FLOAT, 'bool'} | {
    f'{sign}int{size}' for sign in ('', 'u') for size in (8, 16, 32, 64)
}
# The functions that take a shape first, and the position of `dtype`.
_SHAPED = {'zeros': 1, 'ones': 1, 'empty': 1, 'identity': 1, 'full': 2, 'eye': 3}
_SHAPED |= dict.fromkeys(('random.random', 'random.random_sample', 'random.standard_normal'), 9)
_SQUARE = ('identity', 'eye')


class ArrayCalls(Part):
    """Evaluates calls that make arrays."""

    def handlers(self) -> dict[str, Callable[[Arguments, Place], Value]]:
        """Return what evaluates each function, by its full name."""
        return {
            **{f'numpy.{name}': self._shaped(name) for name in _SHAPED},
            'array.array': self._coded,
            'numpy.array': partial(self._listed, 'numpy.array'),
            'numpy.asarray': partial(self._listed, 'numpy.asarray'),
            'numpy.diag': self._diagonal,
            'numpy.linspace': lambda given, _: _array(_dtype(given, 5, _FLOAT), None),
        }

    def _shaped(self, name: str) -> Callable[[Arguments, Place], Value]:
        def call(arguments: Arguments, place: Place) -> Value:
            shape, fill = arguments.get(0, 'shape'), arguments.get(1, 'fill_value')
            kind = _kind_of(fill.value) if name == 'full' and fill else _FLOAT
            size = _size_of(shape.value, place) if shape and not arguments.is_open else None
            if name in _SQUARE and size is not None:
                is_square = len(arguments.positional) == 1 and 'M' not in dict(arguments.named)
                size = size * size if is_square else None
            return _array(_dtype(arguments, _SHAPED[name], kind), size) if shape else UNKNOWN

        return call

    def _listed(self, name: str, arguments: Arguments, _: Place) -> Value:
        given = arguments.get(0, 'object')
        if given is None or not isinstance(given.value, Sequence):
            self._evaluator.calls.escape_all(arguments)
            is_view = self._evaluator.read_only.gives_view(name, arguments)
            return Unknown(chosen_by(arguments), is_read_only=is_view)
        items = [item for item, _ in given.value.items]
        rows = [each for each in items if isinstance(each, Sequence)]
        is_whole = given.value.is_whole and all(each.is_whole for each in rows)
        if rows:
            items = [item for each in rows for item, _ in each.items]
        kinds = {_kind_of(each) for each in items}
        kind = None if None in kinds or not kinds else _FLOAT if _FLOAT in kinds else max(kinds)  # type: ignore[type-var]
        return _array(_dtype(arguments, 1, kind), len(items) if is_whole else None)

    def _diagonal(self, arguments: Arguments, place: Place) -> Value:
        made = self._listed('', arguments, place)
        size = made.type.array_bound if isinstance(made, ArrayField) else None
        given = arguments.get(0, 'v')
        rows = given.value.items if given and isinstance(given.value, Sequence) else []
        if size is None or len(arguments.positional) > 1 or len(rows) != size:
            return UNKNOWN
        return _array(made.type.kind, size * size)  # type: ignore[union-attr]

    def _coded(self, arguments: Arguments, _: Place) -> Value:
        code = arguments.get(0, '')
        known = code.value.value if code and isinstance(code.value, Constant) else ''
        is_number = isinstance(known, str) and known and known in 'bBhHiIlLqQfd'
        self._evaluator.calls.escape_all(arguments)
        return _array(_FLOAT if known in ('f', 'd') else _WHOLE, None) if is_number else UNKNOWN


def _array(kind: str | None, size: int | None) -> Value:
    if kind is None:
        return UNKNOWN
    made = FieldType(kind, array='unbounded' if size is None else 'fixed', array_bound=size)
    return ArrayField(made, is_made=True)


def _dtype(arguments: Arguments, position: int, otherwise: str | None) -> str | None:
    """Return the type of the items of an array; `None` if it is not known."""
    given = arguments.get(position, 'dtype')
    if given is None:
        return None if arguments.is_open else otherwise
    match given.value:
        case External(name=name) | Constant(value=str(name)):
            last = name.rpartition('.')[2]
            return _OF_PYTHON.get(last, last if last in _KINDS else None)
    return None


def _kind_of(value: Value) -> str | None:
    kinds = {each.kind for each in alternatives(value) if isinstance(each, Constant | Scalar)}
    is_known = len(kinds) == len(alternatives(value)) == 1
    return _OF_PYTHON.get(kinds.pop().__name__) if is_known else None


def _size_of(shape: Value, place: Place) -> int | None:
    """Return how many items an array of a shape has."""
    try:
        known = Computation(place).python(shape)
        return prod(known) if isinstance(known, tuple | list) else int(known)
    except (NotKnownError, TypeError, ValueError):
        return None
