"""Compare values of a file with annotations of parameters.

These are `bool`, `int`, `float`, `str`, `Literal['fast', 'slow']`, `Annotated[float, '> 0']`,
lists of them, mappings, and unions of all these. What a bound compares with is a number, or the
name of another argument.
"""

from __future__ import annotations

import ast
import operator
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from composer.python_source.annotations import dotted_name
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

# The types of YAML values that fit an annotation.
_SCALARS: dict[str, tuple[type, ...]] = {
    'bool': (bool,),
    'float': (float, int),
    'int': (int,),
    'str': (str,),
}
_COLLECTIONS: dict[str, tuple[type, str]] = {
    **dict.fromkeys(('dict', 'Dict', 'Mapping', 'MutableMapping'), (dict, 'a mapping')),
    **dict.fromkeys(('list', 'List', 'MutableSequence'), (list, 'a list')),
    **dict.fromkeys(('Collection', 'Iterable', 'Sequence'), (list, 'a list')),
}
_OF_TEXTS = ('Collection', 'Iterable', 'Sequence')
_BOUND = re.compile(r'(>=|<=|>|<)\s*(?:(-?\d+(?:\.\d+)?)|([A-Za-z_]\w*))')
_COMPARISONS: dict[str, Callable[[Any, Any], bool]] = {
    '<': operator.lt,
    '<=': operator.le,
    '>': operator.gt,
    '>=': operator.ge,
}


@record
class WantedValue:
    """One of the kinds of value that an annotation allows.

    Attributes:
        text: It in words.
        fits: Whether the value in question is one of these.
        option: The only value of this kind, if it is a text.
    """

    text: str
    fits: bool
    option: str | None = None


def find_wanted_values(annotation: str, value: Any, given: Mapping[str, Any]) -> list[WantedValue]:
    """Return what an annotation wants if a value does not fit it; nothing if it does, or may.

    Args:
        value: As YAML has it; `None` fits all.
        given: All arguments by name, for bounds that name one.
    """
    if value is None:
        return []
    try:
        wanted = list(_read(_parse(annotation), value, given))
    except (_UnknownAnnotationError, SyntaxError, ValueError, RecursionError):
        return []
    return [] if any(each.fits for each in wanted) else wanted


class _UnknownAnnotationError(Exception):
    """An annotation that says nothing about values of a file."""


@lru_cache(maxsize=1024)
def _parse(text: str) -> ast.expr:
    return ast.parse(text.strip(), mode='eval').body


def _read(expression: ast.expr, value: Any, given: Mapping[str, Any]) -> Iterator[WantedValue]:
    match expression:
        case ast.Constant(value=None):
            return
        case ast.Constant(value=str(text)):
            yield from _read(_parse(text), value, given)
        case ast.BinOp(op=ast.BitOr()):
            yield from _read(expression.left, value, given)
            yield from _read(expression.right, value, given)
        case ast.Name(id=name) if name in _SCALARS:
            types = _SCALARS[name]
            fits = isinstance(value, types) and (bool in types or not isinstance(value, bool))
            fits |= name == 'int' and isinstance(value, float) and value.is_integer()
            yield WantedValue(name, fits)
        case ast.Name(id=name) | ast.Attribute(attr=name) if name in _COLLECTIONS:
            yield _read_collection(name, [], value, given)
        case ast.Subscript(value=form, slice=inner):
            items = inner.elts if isinstance(inner, ast.Tuple) else [inner]
            yield from _read_form(dotted_name(form).rpartition('.')[2], items, value, given)
        case _:
            raise _UnknownAnnotationError


def _read_form(
    name: str, items: list[ast.expr], value: Any, given: Mapping[str, Any]
) -> Iterator[WantedValue]:
    if name == 'Literal':
        for item in items:
            option = ast.literal_eval(item)
            is_same = value == option and isinstance(value, bool) == isinstance(option, bool)
            yield WantedValue(repr(option), bool(is_same), option)
    elif name in ('Union', 'Optional'):
        for item in items:
            yield from _read(item, value, given)
    elif name == 'Annotated':
        bounds = list(_read_bounds(items[1:], given))
        for wanted in _read(items[0], value, given):
            holds = not wanted.fits or all(holds(value) for _, holds in bounds)
            text = ' '.join([wanted.text, ' and '.join(text for text, _ in bounds)]).strip()
            yield WantedValue(text, wanted.fits and holds)
    elif name in _COLLECTIONS:
        yield _read_collection(name, items, value, given)
    else:
        raise _UnknownAnnotationError


def _read_collection(
    name: str, items: list[ast.expr], value: Any, given: Mapping[str, Any]
) -> WantedValue:
    kind, text = _COLLECTIONS[name]
    if kind is dict or not isinstance(value, list):
        # Texts are sequences as well.
        is_text = isinstance(value, str) and name in _OF_TEXTS
        return WantedValue(text, isinstance(value, kind) or is_text)
    try:
        wanted = [list(_read(items[0], each, given)) for each in value] if items else []
    except _UnknownAnnotationError:
        return WantedValue(text, fits=True)
    names = sorted({each.text for options in wanted for each in options})
    fits = all(any(each.fits for each in options) or not options for options in wanted)
    return WantedValue(f'{text} of {" or ".join(names)}' if names else text, fits)


def _read_bounds(
    items: list[ast.expr], given: Mapping[str, Any]
) -> Iterator[tuple[str, Callable[[Any], bool]]]:
    for item in items:
        text = item.value if isinstance(item, ast.Constant) else None
        found = _BOUND.fullmatch(text.strip()) if isinstance(text, str) else None
        if found is None:
            continue
        sign, number, name = found.groups()
        limit: Any = float(number) if number else given.get(name)
        if _is_number(limit):
            shown = number or f"'{name}' ({limit})"
            yield f'{sign} {shown}', _comparison(sign, limit)


def _comparison(sign: str, limit: float) -> Callable[[Any], bool]:
    return lambda value: not _is_number(value) or _COMPARISONS[sign](value, limit)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
