"""Messages in the code of behaviours: what is read and written, and payloads as they are written.

Of these, whatever their text alone shows to be wrong is found.
"""

from __future__ import annotations

import ast
import operator
import re
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.interfaces.descriptions import FieldDescription, FieldType, MessageDescription
from composer.interfaces.field_errors import FieldError, format_field_error, unknown_field
from composer.interfaces.field_values import IN_QUOTES, check_length
from composer.interfaces.message_types import in_python
from composer.interfaces.payload_checks import check_payload
from composer.node_uses.reading import Problem
from composer.spelling import find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.interfaces.message_types import MessageTypes
    from composer.node_uses.reading import MessageUse, Reading, Wire
    from composer.python_source.modules import ModuleSource

_OF_TYPO = re.compile(r"did you mean '\w+'")
_INDEX = re.compile(r'\[(\d+)\]')
_OF_CLASSES = ('get_fields_and_field_types', 'SLOT_TYPES')
# Of types, type checkers know, but not of those of some items.
_OF_VALUES = ('field-length', 'field-range')
_OPERATORS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Mult: operator.mul,
    ast.Sub: operator.sub,
}
# Longer lists are not written out to be measured.
_MOST_REPEATED = 10_000


class NotLiteralError(ComposerError):
    """An expression has no value that its text alone shows."""


def literal_of(node: ast.expr) -> object:
    """Return the value of an expression.

    Raises:
        NotLiteralError: The text alone does not show it.
    """
    match node:
        case ast.Constant(value=None | bool() | int() | float() | str() | bytes() as value):
            return value
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_number(operand)
        case ast.BinOp(left=ast.List(elts=[item]), op=ast.Mult(), right=right):
            times = _number(right)
            if isinstance(times, int) and times <= _MOST_REPEATED:
                return [literal_of(item)] * times
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_number(left), _number(right))
        case ast.List(elts=items) | ast.Tuple(elts=items):
            return [literal_of(each) for each in items]
        case ast.Dict(keys=keys, values=values) if None not in keys:
            return {
                literal_of(key): literal_of(value)
                for key, value in zip(keys, values, strict=True)
                if key
            }
    raise NotLiteralError(ast.dump(node)[:20])


def _number(node: ast.expr) -> float:
    value = literal_of(node)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise NotLiteralError(str(value)[:20])
    return value


def shown_value(node: ast.expr) -> object:
    """Return the value of an expression; `None` as well if its text alone does not show it."""
    with suppress(NotLiteralError):
        return literal_of(node)
    return None


def advise_text(value: ast.expr) -> str:
    """Return the help for a number or a bool where a text is wanted."""
    return f'write {str(value.value)!r}' if isinstance(value, ast.Constant) else 'write str(…)'


def advise_float(value: ast.expr) -> str:
    """Return the help for an integer where a float is wanted."""
    number = shown_value(value)
    return f'write it as a float: {float(number)}' if isinstance(number, int) else 'write float(…)'


def find_problems(
    types: MessageTypes, type_name: str, value: ast.expr, module: ModuleSource
) -> Iterator[Problem]:
    """Yield what is wrong with a payload that becomes a message."""
    description = types.describe(type_name)
    if description is not None:
        yield from _Payloads(types, module).message(description, value)


class _Payloads:
    def __init__(self, types: MessageTypes, module: ModuleSource) -> None:
        self._types = types
        self._module = module

    def message(self, description: MessageDescription, value: ast.expr) -> Iterator[Problem]:
        fields = description.fields
        match value:
            case ast.Constant(value=None):
                # Nothing is sent.
                return
            case ast.IfExp(body=body, orelse=other):
                yield from self.message(description, body)
                yield from self.message(description, other)
            case ast.Dict(keys=keys, values=values):
                for key, item in zip(keys, values, strict=True):
                    if not (isinstance(key, ast.Constant) and isinstance(key.value, str)):
                        continue
                    field = description.field(key.value)
                    if field is not None:
                        yield from self.field(description, field, item)
                    else:
                        names = [each.name for each in fields]
                        error = unknown_field(in_python(description.name), key.value, names)
                        place = self._module.span_of(key, key.value)
                        yield Problem('unknown-field', str(error), place, error.help)
            case _ if len(fields) == 1:
                yield from self.field(description, fields[0], value)
            case ast.Constant(value=bool() | int() | float() | str() as data):
                yield from self._literal(description, value, data)

    def field(
        self, description: MessageDescription, field: FieldDescription, value: ast.expr
    ) -> Iterator[Problem]:
        """Yield what is wrong with the value of a field."""
        nested = self._types.describe(field.type.nested) if field.type.nested else None
        items = value.elts if isinstance(value, ast.List | ast.Tuple) else []
        if isinstance(value, ast.IfExp):
            yield from self.field(description, field, value.body)
            yield from self.field(description, field, value.orelse)
        elif nested is not None and field.type.array is None:
            yield from self.message(nested, value)
        elif nested is not None and items:
            for item in items:
                yield from self.message(nested, item)
        else:
            with suppress(NotLiteralError):
                data = {field.name: literal_of(value)}
                yield from self._literal(replace(description, fields=(field,)), value, data)
                return
            is_open = any(isinstance(item, ast.Starred) for item in items)
            for index, item in enumerate(items if field.type.array else ()):
                name = field.name if is_open else f'{field.name}[{index}]'
                of_item = FieldDescription(name, field.type.item)
                yield from self.field(description, of_item, item)
            if items and field.type.array and not is_open:
                try:
                    check_length(field.type, len(items))
                except FieldError as error:
                    text = format_field_error(description.name, (field.name,), str(error))
                    yield Problem(error.rule, text, self._module.span_of(value), error.help)

    def _literal(
        self, description: MessageDescription, value: ast.expr, data: object
    ) -> Iterator[Problem]:
        for finding in check_payload(description, data, self._types.catalogue):
            place = self._module.span_of(value)
            message = finding.message.replace(description.name, in_python(description.name))
            is_text = finding.help == IN_QUOTES and isinstance(value, ast.Constant)
            help_text = advise_text(value) if is_text else finding.help
            yield Problem(finding.rule, message, place, help_text)


def check_message_uses(
    types: MessageTypes, wire: Wire, reading: Reading, *, is_one: bool
) -> Iterator[Problem]:
    """Yield what is wrong with the uses of messages.

    Args:
        is_one: Whether the behaviour is given messages of one type.
    """
    for use in reading.message_uses:
        type_name = use.of_type or (wire.given if is_one else None)
        description = types.describe(type_name) if type_name else None
        problem = _find_problem(types, description, use) if description else None
        if problem is not None:
            if use.is_certain or _OF_TYPO.match(problem.help or ''):
                yield problem
        elif use.is_write and wire.is_read_only and use.of_type is None:
            text = 'this writes to a message that a read_only subscription shares with others'
            help_text = "write to a copy, as copy.deepcopy makes one, or remove 'read_only: true'"
            place = use.module.span_of(use.node)
            yield Problem('read-only-message', text, place, help_text)


def _find_problem(
    types: MessageTypes, description: MessageDescription, use: MessageUse
) -> Problem | None:
    found: FieldType | MessageDescription | None = description
    for position, name in enumerate(use.path, start=1):
        written = _part_of(use.node, len(use.path) - position)
        if isinstance(found, MessageDescription) and name[0] != '[':
            field = found.field(name)
            if field is None:
                wrong = explain_unknown(types, found, name)
                # What is kept under another name is found where that gets it.
                is_here = isinstance(written, ast.keyword) or getattr(written, 'attr', '') == name
                if wrong is None or not is_here:
                    return None
                return Problem('unknown-field', wrong[0], use.module.span_of(written), wrong[1])
            if use.value is not None and name is use.path[-1]:
                problems = _Payloads(types, use.module).field(found, field, use.value)
                whole = use.module.span_of(use.value)
                known = (
                    each for each in problems if each.rule in _OF_VALUES or each.place != whole
                )
                return next(known, None)
            found = field.type
        elif isinstance(found, FieldType) and found.array and name[0] == '[':
            problem = _wrong_index(found, name, written, use.module)
            if problem is not None:
                return problem
            found = found.item
        else:
            return None
        if found.nested and not found.array:
            found = types.describe(found.nested)
    return None


def _part_of(node: ast.AST, count: int) -> ast.AST:
    """Return the part of a chain of attributes and items before the last ones."""
    for _ in range(count):
        node = node.value if isinstance(node, ast.Attribute | ast.Subscript) else ast.Pass()
    return node


def _wrong_index(
    array: FieldType, name: str, written: ast.AST, module: ModuleSource
) -> Problem | None:
    match = _INDEX.fullmatch(name)
    bound = array.array_bound if array.array == 'fixed' else None
    if match is None or bound is None or int(match[1]) < bound:
        return None
    if not isinstance(written, ast.Subscript):
        return None
    text = f'there is no item {match[1]}: this has {bound}, from 0 to {bound - 1}'
    return Problem('bad-index', text, module.span_of(written.slice))


def explain_unknown(
    types: MessageTypes, owner: MessageDescription, name: str
) -> tuple[str, str | None] | None:
    """Return what is wrong with a name that a message does not have, and the help."""
    if name.startswith('_') or name in _OF_CLASSES:
        return None
    known, shown = types.constants(owner.name), in_python(owner.name)
    if name.isupper():
        if types.may_have_constant(owner.name, name):
            return None
        if find_nearest(name, known):
            return f"{shown} has no constant '{name}'", suggest(name, known, 'it has')
    singles = [each for each in owner.fields if each.type.nested and not each.type.array]
    parts = [(each.name, types.describe(each.type.nested or '')) for each in singles]
    having = [f'{of}.{name}' for of, part in parts if part and part.field(name)]
    meant = having[0] if len(having) == 1 else None
    error = unknown_field(shown, name, [each.name for each in owner.fields], meant)
    return str(error), error.help
