"""What Python's own functions make of values that are known: they are called with them."""

from __future__ import annotations

import json
from array import array
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice, product
from math import prod
from typing import TYPE_CHECKING, Any

from composer.inference.evaluation.operators import SAMPLES
from composer.inference.values import (
    NONE,
    ArrayField,
    Constant,
    Generated,
    Mapping,
    Message,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    constant,
    is_none,
    join,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

# Larger numbers, longer texts and longer lists are not computed.
_GREATEST = 2**64
_LONGEST = 1000
_MOST_ITEMS = 256
_SCALARS = (bool, int, float, str, bytes, type(None))
_BUILDERS: dict[type, Callable[[Any], Any]] = {
    each: each for each in (list, tuple, set, frozenset, deque)
}
_KEYS: tuple[type, ...] = (type({}.keys()), type({}.values()), type({}.items()))

_CONTAINERS: Any = (*_BUILDERS, *_KEYS, Iterator)
_CODES = {'float32': 'f', 'float64': 'd'}
_MOST_TRIED = 4
_MESSAGE = type('message', (), {})()


class NotKnownError(Exception):
    """A value is not known, or too large to be computed with."""


@dataclass(frozen=True, slots=True, eq=False)
class Leaf:
    """An item of a container, whatever it is, and where it is written."""

    value: Value
    place: Place


def leaves_of(value: Value, place: Place) -> list[Leaf]:
    """Return the items of a container.

    Args:
        place: Where those are written of which that is not known.

    Raises:
        NotKnownError: Not all of them are known, or their order is not.
    """
    if isinstance(value, Mapping) and not (value.is_open or value.is_lost):
        return [Leaf(constant(key, at), at) for key, (_, at) in value.entries.items()]
    if isinstance(value, Constant) and value.kind is str:
        _check_size(value.value)
        return [Leaf(constant(each), value.origin or place) for each in value.value]
    if isinstance(value, Sequence) and value.is_whole and value.is_ordered:
        return [Leaf(*each) for each in value.items]
    if isinstance(value, Generated) and value.items is not None:
        return [Leaf(each, place) for each in value.items]
    raise NotKnownError


def arrange(function: Callable[..., Any], arguments: Iterable[Value], place: Place) -> Value:
    """Return what a function makes of containers whose items may be anything.

    Raises:
        NotKnownError: Not all items are known, or the function refuses them.
    """
    made = Computation(place)
    given: list[Any] = []
    for value in arguments:
        if isinstance(value, Constant) and value.kind is int:
            given.append(value.value)
        else:
            given.append(leaves_of(value, place))
    return made.call_plainly(function, *given)


def refusal(function: Callable[..., Any], *arguments: Value, **named: Value) -> str | None:
    """Return Python's own words if it refuses the types of some values, whatever they are."""
    given = (*arguments, *named.values())
    several = [[each for each in alternatives(value) if not is_none(each)] for value in given]
    if not all(several) or prod(map(len, several)) > _MOST_TRIED:
        return None
    found = {_refusal(function, [*named], *each) for each in product(*several)}
    return None if None in found else min(filter(None, found))


def _refusal(function: Callable[..., Any], names: list[str], *arguments: Value) -> str | None:
    count = len(arguments) - len(names)
    try:
        samples = [_sample(each, function) for each in arguments]
        function(*samples[:count], **dict(zip(names, samples[count:], strict=True)))
    except TypeError as error:
        return str(error)
    except Exception:  # noqa: BLE001
        return None
    return None


def _sample(value: Value, function: Callable[..., Any] | None = None) -> Any:
    """Return some value of the same type.

    Raises:
        NotKnownError: The type is not known.
    """
    match value:
        case Constant() | Scalar() if value.kind in SAMPLES and not getattr(value, 'member', 0):
            return SAMPLES[value.kind]
        case Scalar() if issubclass(value.kind, BaseException):
            return value.kind()
        case Sequence() if value.items and not value.is_lost and value.kind in _BUILDERS:
            return _BUILDERS[value.kind](
                _sample(item, function) for item, _ in value.items[:_MOST_TRIED]
            )
        case Mapping(entries=entries) if function is json.dumps and not value.is_lost:
            # What else it is given may be a counter, which has operators.
            return {key: _json(held) for key, (held, _) in entries.items()}
        case Message():
            return _MESSAGE
        case PartOfNode(name='time' | 'duration') if function is json.dumps:
            return _MESSAGE
        case ArrayField(is_made=False) if value.type.array != 'fixed' and not value.type.nested:
            if value.type.kind in ('string', 'wstring'):
                return ['1']
            return array(_CODES.get(value.type.kind, 'b'), [1])
    raise NotKnownError


def _json(value: Value) -> Any:
    with suppress(NotKnownError):
        return _sample(value, json.dumps)
    return None


class Computation:
    """Calls a function of Python with values that are known.

    What comes out and is one of the values that went in, was written where that was.

    Args:
        place: Where everything else is written that comes out.
    """

    def __init__(self, place: Place) -> None:
        self._place = place
        self._given: dict[tuple[type, object], Constant] = {}
        self._chosen = 0

    def call(self, function: Callable[..., Any], *arguments: Value, **named: Value) -> Value:
        """Return what a function makes of values.

        Raises:
            NotKnownError: One of them is not known, or the function refuses them.
        """
        given = [self.python(each) for each in arguments]
        options = {name: self.python(each) for name, each in named.items()}
        return self.call_plainly(function, *given, **options)

    def call_plainly(self, function: Callable[..., Any], *given: Any, **options: Any) -> Value:
        """Return what a function makes of values of Python.

        Raises:
            NotKnownError: It refuses them.
        """
        try:
            return self.value(function(*given, **options))
        except NotKnownError:
            raise
        except Exception as error:
            raise NotKnownError from error

    def python(self, value: Value) -> Any:
        """Return a value of Python.

        Raises:
            NotKnownError: It is not known.
        """
        match value:
            case Constant():
                _check_size(value.value)
                self._chosen = max(self._chosen, value.is_chosen)
                self._given.setdefault((value.kind, value.value), value)
                return value.value
            case Sequence() if value.is_whole and len(value.items) <= _MOST_ITEMS:
                items = [self.python(item) for item, _ in value.items]
                if value.kind in _BUILDERS:
                    return _BUILDERS[value.kind](items)
                if value.kind is range or issubclass(value.kind, tuple):
                    return tuple(items)
                if value.kind in _KEYS:
                    return dict.fromkeys(items).keys()
                raise NotKnownError
            case Generated(items=tuple(items)):
                return iter([self.python(item) for item in items])
            case Mapping() if not (value.is_open or value.is_lost):
                return {key: self.python(held) for key, (held, _) in value.entries.items()}
        raise NotKnownError

    def value(self, found: Any) -> Value:
        """Return a value of Python as one of a behaviour.

        Raises:
            NotKnownError: It cannot be one.
        """
        if isinstance(found, Leaf):
            return found.value
        if isinstance(found, _SCALARS):
            _check_size(found)
            before = self._given.get((type(found), found))
            return before or constant(found, is_chosen=self._chosen)
        if isinstance(found, dict):
            entries = {_key(key): self._item(key, held) for key, held in found.items()}
            return Mapping(entries)
        if isinstance(found, _CONTAINERS):
            items: list[Any] = list(islice(found, _MOST_ITEMS + 1))
            if len(items) > _MOST_ITEMS:
                raise NotKnownError
            held = [self._item(each, each) for each in items]
            if isinstance(found, Iterator):
                values = tuple(value for value, _ in held)
                # Who goes through nothing may find what is stored until then.
                return Generated(join(values), NONE, items=values or None)
            return Sequence(held, type(found), origin=self._place)
        raise NotKnownError

    def _item(self, written: Any, held: Any) -> tuple[Value, Place]:
        value = self.value(held)
        for each in (written, held):
            if isinstance(each, Leaf):
                return value, each.place
        known = self._given.get((type(written), written)) if _is_plain(written) else None
        return value, (known and known.origin) or self._place


def _key(key: Any) -> object:
    """Return the key of a mapping."""
    if isinstance(key, Leaf):
        if not isinstance(key.value, Constant):
            raise NotKnownError
        return key.value.value
    return key


def _is_plain(value: object) -> bool:
    return isinstance(value, _SCALARS)


def _check_size(value: object) -> None:
    if isinstance(value, str | bytes):
        if len(value) > _LONGEST:
            raise NotKnownError
    elif isinstance(value, int) and abs(value) > _GREATEST:
        raise NotKnownError
