"""Read annotations of functions by the imports of their module, and compare values with them.

Those that values are compared with are `bool`, `int`, `float`, `str`,
`Literal['fast', 'slow']`, `Annotated[float, '> 0']`, lists of them, mappings, and unions of all
these. What a bound compares with is a number, or the name of another argument.
"""

from __future__ import annotations

import ast
import operator
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

_BUILTINS = {'bool', 'bytes', 'dict', 'float', 'int', 'list', 'set', 'str', 'tuple'}
# The classes are in modules with a leading underscore, such as `std_msgs.msg._string`.
_INTERFACE = re.compile(
    r'(\w+)\.(msg|srv|action)\.(?:_\w+\.)*([A-Z]\w*)'
    r'(?:\.(Request|Response|Goal|Result|Feedback))?'
)


def read_annotation(expression: ast.expr | None, imports: Mapping[str, str]) -> str:
    """Return the interface or the built-in type of an annotation; empty if it can mean anything.

    Args:
        imports: The full dotted names of what the module imports, by name.
    """
    if isinstance(expression, ast.Constant) and isinstance(expression.value, str):
        try:
            expression = _parse(expression.value)
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            return ''
    if isinstance(expression, ast.Subscript):
        expression = expression.value
    first, separator, rest = dotted_name(expression).partition('.')
    full = imports.get(first)
    if full is None:
        return first if first in _BUILTINS and not rest else ''
    return find_interface(full + separator + rest) or ''


def dotted_name(expression: ast.expr | None) -> str:
    """Return a dotted name such as `a.b.c`, or an empty text."""
    parts: list[str] = []
    while isinstance(expression, ast.Attribute):
        parts.append(expression.attr)
        expression = expression.value
    return '.'.join([expression.id, *reversed(parts)]) if isinstance(expression, ast.Name) else ''


def find_interface(name: str) -> str | None:
    """Return the interface of a dotted name, as generated packages name it, or `None`."""
    match = _INTERFACE.fullmatch(name)
    if match is None:
        return None
    *full, part = match.groups()
    return '/'.join(full) + (f'_{part}' if part else '')


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
    items: list[ast.expr] = []
    match expression:
        case ast.Constant(value=None):
            return
        case ast.Constant(value=str(text)):
            yield from _read(_parse(text), value, given)
            return
        case ast.BinOp(op=ast.BitOr(), left=left, right=right):
            name, items = 'Union', [left, right]
        case ast.Subscript(value=form, slice=inner):
            name = dotted_name(form)
            items = inner.elts if isinstance(inner, ast.Tuple) else [inner]
        case _:
            name = dotted_name(expression)
    yield from _read_form(name.rpartition('.')[2], items, value, given)


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
        bounds = list(_read_bounds(items[1:], value, given))
        for wanted in _read(items[0], value, given):
            fits = wanted.fits and all(holds for _, holds in bounds)
            text = ' '.join([wanted.text, ' and '.join(text for text, _ in bounds)]).strip()
            yield WantedValue(text, fits)
    elif name in _SCALARS:
        types = _SCALARS[name]
        fits = isinstance(value, types) and (bool in types or not isinstance(value, bool))
        fits |= name == 'int' and isinstance(value, float) and value.is_integer()
        yield WantedValue(name, fits)
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
    items: list[ast.expr], value: Any, given: Mapping[str, Any]
) -> Iterator[tuple[str, bool]]:
    for item in items:
        text = item.value if isinstance(item, ast.Constant) else None
        found = _BOUND.fullmatch(text.strip()) if isinstance(text, str) else None
        if found is None:
            continue
        sign, number, name = found.groups()
        limit: Any = float(number) if number else given.get(name)
        if _is_number(limit):
            shown = number or f"'{name}' ({limit})"
            yield f'{sign} {shown}', not _is_number(value) or _COMPARISONS[sign](value, limit)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
