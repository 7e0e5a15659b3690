"""Operators: what comes out of `+`, `<`, `not` and the like."""

from __future__ import annotations

import ast
import operator
import re
from array import array
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.inference.values import (
    AGAIN,
    ANY,
    BY_FILE,
    UNKNOWN,
    ArrayField,
    Class,
    Constant,
    Function,
    Instance,
    Mapping,
    Message,
    MessageClass,
    NodeValue,
    PartOfNode,
    Scalar,
    Sequence,
    Unknown,
    Value,
    alternatives,
    chosen_with,
    constant,
    is_chosen,
    is_none,
    join,
    pattern_of,
    truth_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable

ARITHMETIC: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
}
_EPOCH = datetime.fromtimestamp(0, UTC)
_SAMPLES: list[Any] = [
    None,
    True,
    1,
    1.0,
    '1',
    b'1',
    [],
    Path(),
    _EPOCH,
    _EPOCH.date(),
    timedelta(1),
]
# A value of each type that operators are tried with.
SAMPLES: dict[type | None, Any] = {type(each): each for each in _SAMPLES}
_CONVERSION = re.compile(r'%[-+ #0-9.]*[a-zA-Z]')
_EQUALITIES = (operator.eq, operator.ne)
_NUMBERS = (bool, int, float)
_SETS: tuple[type, ...] = (set, frozenset, type({}.keys()))
COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
# What raises for values of some types; a text before `%` says itself what it takes.
OPERATIONS: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    **{sign: compute for sign, compute in ARITHMETIC.items() if sign is not ast.Mod},
    **{sign: compare for sign, compare in COMPARISONS.items() if compare not in _EQUALITIES},
}
# Values of two of these are never equal.
_COMPARED = (
    _NUMBERS,
    (str,),
    (bytes, bytearray),
    (list,),
    (dict,),
    (tuple,),
    (Message,),
    (array,),
    (Instance,),
)
# What makes a large number of two small ones.
_POWERS = (ast.Pow, ast.LShift)
# Larger numbers and longer texts are not computed.
_GREATEST = 2**64
_LONGEST = 200
_LONGEST_REPEATED = 100_000
_GREATEST_POWER = 64
# What an operator may meet in pairs.
_MOST_PAIRS = 16
# How long the sequences are that are computed.
_MOST_ITEMS = 256


def combine(sign: ast.operator, left: Value, right: Value) -> Value:
    """Return what a binary operator makes of two values."""
    # What may be None is combined where it is something else.
    ones, others = (
        [each for each in alternatives(value) if not is_none(each)] or [value]
        for value in (left, right)
    )
    pairs = [(one, other) for one in ones for other in others]
    if len(pairs) > _MOST_PAIRS:
        return UNKNOWN
    return join(_combine(sign, *pair) for pair in pairs)


def refuses_time(sign: ast.operator | ast.cmpop, left: Value, right: Value) -> bool:
    """Return whether an operator refuses a time of rclpy with what it meets."""
    if isinstance(sign, ast.Eq | ast.NotEq | ast.Is | ast.IsNot | ast.In | ast.NotIn):
        return False
    pairs = [(one, other) for one in alternatives(left) for other in alternatives(right)]
    return all(_refuse_time(sign, *pair) for pair in pairs)


def _refuse_time(sign: ast.operator | ast.cmpop, left: Value, right: Value) -> bool:
    time = PartOfNode('time')
    if left == right == time:
        return isinstance(sign, ast.Add)
    if time not in (left, right):
        return False
    other = right if left == time else left
    if isinstance(other, Message):
        return True
    return isinstance(other, Constant | Scalar) and other.kind in _NUMBERS


def _combine(sign: ast.operator, left: Value, right: Value) -> Value:
    chosen = chosen_with(left, right)
    if isinstance(left, Constant) and isinstance(right, Constant):
        compute = ARITHMETIC.get(type(sign))
        is_power = isinstance(sign, _POWERS) and abs(hash(right.value)) > _GREATEST_POWER
        is_small = _is_small(left.value) and _is_small(right.value)
        if compute and is_small and not is_power and not _is_repeated(sign, left, right):
            try:
                return constant(compute(left.value, right.value), is_chosen=chosen)
            except (ArithmeticError, TypeError, ValueError):
                return Unknown(chosen)
    if isinstance(left, PartOfNode) and isinstance(right, PartOfNode):
        is_difference = left.name == right.name == 'time' and isinstance(sign, ast.Sub)
        return PartOfNode('duration') if is_difference else UNKNOWN
    if isinstance(left, ArrayField) and left == right and left.type.nested:
        return left
    if AGAIN in (left, right) and isinstance(sign, ast.Add):
        other = right if left == AGAIN else left
        if isinstance(other, Sequence) and not other.is_lost:
            return Sequence(list(other.items), other.kind, is_open=True)
    for one, other in ((left, right), (right, left)):
        if isinstance(one, ArrayField) and one.is_made and _kind(other) in (int, float):
            is_float = _kind(other) is float or isinstance(sign, ast.Div)
            kind = 'float64' if is_float else one.type.kind
            return one if one.type.nested else replace(one, type=replace(one.type, kind=kind))
    if isinstance(left, Sequence):
        return _combine_sequence(sign, left, right)
    kinds = (_kind(left), _kind(right))
    result = _result(sign, *kinds)
    if result is not None:
        return Scalar(result, chosen, pattern=_pattern(sign, left, right))
    return Unknown(chosen)


def _pattern(sign: ast.operator, left: Value, right: Value) -> str:
    if isinstance(sign, ast.Mod) and isinstance(left, Constant) and left.kind is str:
        return _CONVERSION.sub(ANY, left.value)
    is_sum = isinstance(sign, ast.Add) and _kind(left) is str
    return pattern_of(left) + pattern_of(right) if is_sum else ''


def _combine_sequence(sign: ast.operator, left: Sequence, right: Value) -> Value:
    """Return what `[0.0] * 6` and `[1] + [2]` make."""
    if left.is_lost:
        return UNKNOWN
    if left.kind in _SETS and isinstance(right, Sequence) and right.kind in _SETS:
        return _combine_sets(sign, left, right)
    if isinstance(sign, ast.Add) and isinstance(right, Sequence) and not right.is_lost:
        items = [*left.items, *right.items]
        return Sequence(items, left.kind, left.is_open or right.is_open, origin=left.origin)
    times = right.value if isinstance(right, Constant) and right.kind in (int, bool) else -1
    if isinstance(sign, ast.Mult) and 0 <= times * len(left.items) <= _MOST_ITEMS:
        return Sequence(left.items * times, left.kind, left.is_open, origin=left.origin)
    if isinstance(sign, ast.Mult):
        return Sequence(list(left.items), left.kind, is_open=True, origin=left.origin)
    return UNKNOWN


def _combine_sets(sign: ast.operator, left: Sequence, right: Sequence) -> Value:
    """Return what `{1, 2} - {2}` makes."""
    items = [*left.items, *right.items]
    values = [value for value, _ in items]
    if not (left.is_whole and right.is_whole and all(isinstance(v, Constant) for v in values)):
        return UNKNOWN
    known = {item[0]: item for item in items}
    both = [dict.fromkeys(value for value, _ in each.items).keys() for each in (left, right)]
    try:
        found = ARITHMETIC[type(sign)](*both)
    except (KeyError, TypeError):
        return UNKNOWN
    return Sequence([item for value, item in known.items() if value in found], set)


def _is_small(value: object) -> bool:
    if isinstance(value, str):
        return len(value) < _LONGEST
    return isinstance(value, _NUMBERS) and (value != value or abs(value) < _GREATEST)  # noqa: PLR0124


def _is_repeated(sign: ast.operator, left: Constant, right: Constant) -> bool:
    """Return whether `text * number` is a longer text than is computed."""
    if not isinstance(sign, ast.Mult) or str not in (left.kind, right.kind):
        return False
    sizes = [len(each.value) if each.kind is str else each.value for each in (left, right)]
    return int in (left.kind, right.kind) and sizes[0] * sizes[1] > _LONGEST_REPEATED


def _kind(value: Value) -> type | None:
    return value.kind if isinstance(value, Constant | Scalar) else None


def _result(sign: ast.operator, left: type | None, right: type | None) -> type | None:
    if left is str and isinstance(sign, ast.Mod):
        return str
    try:
        found = type(ARITHMETIC[type(sign)](SAMPLES[left], SAMPLES[right]))
    except (KeyError, TypeError):
        return None
    return found


def negate(sign: ast.unaryop, value: Value) -> Value:
    """Return what a unary operator makes of a value."""
    if isinstance(sign, ast.Not):
        truth = truth_of(value)
        if truth is None:
            return Scalar(bool, is_chosen(value))
        return constant(not truth, is_chosen=is_chosen(value))
    return join(_negate(sign, each) for each in alternatives(value))


def _negate(sign: ast.unaryop, value: Value) -> Value:
    if isinstance(value, Constant) and value.kind in (int, float):
        if isinstance(sign, ast.USub):
            return Constant(value.kind, -value.value, value.is_chosen, value.origin)
        if isinstance(sign, ast.UAdd):
            return value
    if isinstance(value, Constant) and value.kind is int and isinstance(sign, ast.Invert):
        return Constant(int, ~value.value, value.is_chosen, value.origin)
    if isinstance(value, Scalar) and value.kind in (int, float):
        return value
    return UNKNOWN


def is_never_equal(sign: ast.cmpop, left: Value, right: Value) -> bool:
    """Return whether two values are of types that are never equal, whatever they are.

    What the file gives may be of another type in another file.
    """
    if isinstance(sign, ast.In | ast.NotIn) and isinstance(right, Sequence) and right.is_whole:
        return bool(right.items) and all(
            is_never_equal(ast.Eq(), left, item) for item, _ in right.items
        )
    kinds = [{_group(each) for each in alternatives(value)} for value in (left, right)]
    is_known = not any(None in each for each in kinds) and BY_FILE not in map(
        is_chosen, (left, right)
    )
    return isinstance(sign, ast.Eq | ast.NotEq) and is_known and not kinds[0] & kinds[1]


def _group(value: Value) -> int | None:
    kind = type_of(value)
    return next((at for at, kinds in enumerate(_COMPARED) if kind in kinds), None)


def type_of(value: Value) -> type | None:
    """Return the type that a value has in Python; `Message` for any message."""
    match value:
        case Constant() | Scalar() if getattr(value, 'member', None) is None:
            return value.kind
        case Sequence() | Mapping() if not value.is_lost:
            return dict if isinstance(value, Mapping) else value.kind
        case Message() | MessageClass() | PartOfNode() | Instance(is_no_value=True):
            return type(value)
        case ArrayField(is_made=False) if value.type.array != 'fixed' and not value.type.nested:
            is_list = value.type.kind in ('bool', 'byte', 'string', 'wstring')
            return list if is_list else array
    return None


def explain_unset(name: str) -> tuple[str, str]:
    """Return what is wrong with a parameter that has no value yet, and help."""
    text = f"the parameter '{name}' has no value until something sets it: this may be None"
    return text, 'give it a default, or ask whether it is None'


def type_in_words(value: Value) -> str:
    """Return the types that a value may have."""
    names = (getattr(type_of(each), '__name__', '').lower() for each in alternatives(value))
    return ' or '.join(dict.fromkeys(names)) or 'these'


def compare(sign: ast.cmpop, left: Value, right: Value) -> Value:
    """Return what a comparison says, as far as it is known."""
    known = _compare(sign, left, right)
    chosen = chosen_with(left, right)
    if known is not None:
        return constant(known, is_chosen=chosen)
    plain = all(isinstance(each, Constant | Scalar) for each in (left, right)) or all(
        isinstance(each, Sequence | Mapping) for each in (left, right)
    )
    if plain or isinstance(sign, ast.Is | ast.IsNot | ast.In | ast.NotIn):
        return Scalar(bool, chosen)
    # NumPy compares item by item.
    return Unknown(chosen)


def _compare(sign: ast.cmpop, left: Value, right: Value) -> bool | None:
    if isinstance(sign, ast.Eq | ast.NotEq) and isinstance(left, Class | Function | Instance):
        same = _is_same(left, right)
        return None if same is None else same == isinstance(sign, ast.Eq)
    if isinstance(sign, ast.Is | ast.IsNot):
        same = _is_same(left, right)
        return None if same is None else same == isinstance(sign, ast.Is)
    if isinstance(sign, ast.In | ast.NotIn):
        held = _is_in(left, right)
        return None if held is None else held == isinstance(sign, ast.In)
    if isinstance(left, Constant) and isinstance(right, Constant):
        try:
            return bool(COMPARISONS[type(sign)](left.value, right.value))
        except TypeError:
            return None
    return None


def _is_same(left: Value, right: Value) -> bool | None:
    """Return whether two values are one: of interest for `None`, and for classes."""
    pairs = {_are_one(one, other) for one in alternatives(left) for other in alternatives(right)}
    return pairs.pop() if len(pairs) == 1 else None


def _are_one(left: Value, right: Value) -> bool | None:
    if isinstance(left, Constant) and isinstance(right, Constant):
        singletons = (None, True, False)
        known = left.value in singletons and right.value in singletons
        same = left.kind is right.kind and left.value == right.value
        return same if known or left.kind is not right.kind else None
    if left == right and isinstance(left, NodeValue):
        return True
    if isinstance(left, Instance) and isinstance(right, Instance):
        return left is right if left.is_member and right.is_member else None
    if isinstance(left, Function | Class) and isinstance(right, Function | Class):
        return None if left.definition is right.definition else False
    for one, other in ((left, right), (right, left)):
        if isinstance(one, Constant) and one.value is None:
            certain = (Message, MessageClass, NodeValue, Mapping, Sequence)
            return False if isinstance(other, certain) else None
    if isinstance(left, MessageClass) and isinstance(right, MessageClass):
        return left == right
    return None


def _are_equal(left: Value, right: Value) -> bool:
    return isinstance(left, Constant) and isinstance(right, Constant) and left.value == right.value


def _is_in(item: Value, container: Value) -> bool | None:
    if isinstance(item, MessageClass) and isinstance(container, Sequence) and container.is_whole:
        same = [_are_one(item, value) for value, _ in container.items]
        return True if True in same else None if None in same else False
    if not isinstance(item, Constant):
        return None
    if isinstance(container, Constant) and isinstance(container.value, str):
        return item.value in container.value if isinstance(item.value, str) else None
    if isinstance(container, Mapping) and not container.is_lost:
        return None if container.is_open else item.value in container.entries
    if isinstance(container, Sequence) and container.is_whole:
        values = [value for value, _ in container.items]
        if all(isinstance(value, Constant) for value in values):
            return any(_are_equal(item, value) for value in values)
    return None
