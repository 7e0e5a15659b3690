"""Read annotations of functions, by the imports of their module."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping

_BUILTINS = {'bool', 'bytes', 'dict', 'float', 'int', 'list', 'set', 'str', 'tuple'}
_GENERATORS = {'AsyncGenerator', 'AsyncIterable', 'AsyncIterator'} | {
    'Generator',
    'Iterable',
    'Iterator',
}
_KINDS = ('msg', 'srv', 'action')
_PARTS = {
    'srv': {'Request', 'Response'},
    'action': {'Goal', 'Result', 'Feedback'},
}
# `package.kind.Name`
_LENGTH = 3


@record
class Annotation:
    """What is known of an annotation; nothing if it can mean anything.

    Attributes:
        interface: The full name of an interface type, as in `std_msgs/msg/String` or
            `std_srvs/srv/SetBool_Request`.
        builtin: The name of a built-in type, as in `str`.
        items: The arguments of a generator type, as in `Generator[yielded, sent, returned]`.
    """

    interface: str | None = None
    builtin: str | None = None
    items: tuple[ast.expr, ...] = ()


def read_annotation(expression: ast.expr | None, imports: Mapping[str, str]) -> Annotation:
    """Return what is known of an annotation in a module.

    Args:
        imports: The full dotted names of what the module imports, by name.
    """
    if isinstance(expression, ast.Constant) and isinstance(expression.value, str):
        try:
            expression = ast.parse(expression.value, mode='eval').body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            return Annotation()
    if isinstance(expression, ast.Subscript):
        return _read_subscript(expression)
    name = dotted_name(expression)
    if name in _BUILTINS and name not in imports:
        return Annotation(builtin=name)
    first, separator, rest = name.partition('.')
    full = imports.get(first)
    return Annotation(interface=find_interface(full + separator + rest)) if full else Annotation()


def _read_subscript(expression: ast.Subscript) -> Annotation:
    name = dotted_name(expression.value)
    if name in _BUILTINS:
        return Annotation(builtin=name)
    if name.rpartition('.')[2] in _GENERATORS:
        items = expression.slice
        return Annotation(items=tuple(items.elts if isinstance(items, ast.Tuple) else [items]))
    return Annotation()


def dotted_name(expression: ast.expr | None) -> str:
    """Return a dotted name such as `a.b.c`, or an empty text."""
    parts: list[str] = []
    while isinstance(expression, ast.Attribute):
        parts.append(expression.attr)
        expression = expression.value
    return '.'.join([expression.id, *reversed(parts)]) if isinstance(expression, ast.Name) else ''


def find_interface(name: str) -> str | None:
    """Return the interface of a dotted name, as generated packages name it, or `None`."""
    # The classes are in modules with a leading underscore, such as `std_msgs.msg._string`.
    parts = [part for part in name.split('.') if not part.startswith('_')]
    if len(parts) < _LENGTH or parts[1] not in _KINDS or not parts[2][:1].isupper():
        return None
    full = '/'.join(parts[:_LENGTH])
    if len(parts) == _LENGTH:
        return full
    inner = parts[_LENGTH]
    is_part = len(parts) == _LENGTH + 1 and inner in _PARTS.get(parts[1], ())
    return f'{full}_{inner}' if is_part else None
