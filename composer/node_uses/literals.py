"""Payloads as they are written in the code: what is wrong in them whatever else they hold."""

from __future__ import annotations

import ast
import operator
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.interfaces.field_errors import FieldError, format_field_error, unknown_field
from composer.interfaces.field_values import check_length
from composer.interfaces.message_types import in_python
from composer.interfaces.payload_checks import check_payload
from composer.node_uses.reading import Problem

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.interfaces.descriptions import FieldDescription, MessageDescription
    from composer.interfaces.message_types import MessageTypes
    from composer.python_source.modules import ModuleSource

# Of types, type checkers know.
_OF_VALUES = ('field-length', 'field-range')
_OPERATORS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Mult: operator.mul,
    ast.Sub: operator.sub,
}


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


def number_of(node: ast.expr) -> float | None:
    """Return the number that an expression is, if its text alone shows it."""
    try:
        return _number(node)
    except NotLiteralError:
        return None


def find_problems(
    types: MessageTypes, type_name: str, value: ast.expr, module: ModuleSource
) -> Iterator[Problem]:
    """Yield what is wrong with a payload that becomes a message."""
    description = types.describe(type_name)
    if description is not None:
        yield from _Payloads(types, module).message(description, value)


def find_misfit(
    types: MessageTypes,
    description: MessageDescription,
    field: FieldDescription,
    value: ast.expr,
    module: ModuleSource,
) -> Problem | None:
    """Return why what is stored in a field is out of its range, or has another length."""
    problems = _Payloads(types, module).field(description, field, value)
    return next((each for each in problems if each.rule in _OF_VALUES), None)


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
                    if isinstance(key, ast.Constant) and isinstance(key.value, str):
                        yield from self._entry(description, key.value, key, item)
            case _ if len(fields) == 1:
                yield from self.field(description, fields[0], value)
            case ast.Constant(value=bool() | int() | float() | str()):
                yield from self._literal(description, value, value)

    def _entry(
        self, description: MessageDescription, name: str, key: ast.expr, value: ast.expr
    ) -> Iterator[Problem]:
        field = description.field(name)
        if field is not None:
            yield from self.field(description, field, value)
            return
        names = [each.name for each in description.fields]
        error = unknown_field(in_python(description.name), name, names)
        place = self._module.span_of(key, name)
        yield Problem('unknown-field', str(error), place, error.help)

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
            yield from self._scalars(description, field, value, items)

    def _scalars(
        self,
        description: MessageDescription,
        field: FieldDescription,
        value: ast.expr,
        items: list[ast.expr],
    ) -> Iterator[Problem]:
        try:
            data = literal_of(value)
        except NotLiteralError:
            if not (items and field.type.array) or any(
                isinstance(item, ast.Starred) for item in items
            ):
                return
            try:
                check_length(field.type, len(items))
            except FieldError as error:
                text = format_field_error(description.name, (field.name,), str(error))
                yield Problem(error.rule, text, self._module.span_of(value), error.help)
            return
        yield from self._literal(description, value, {field.name: data})

    def _literal(
        self, description: MessageDescription, value: ast.expr, data: object
    ) -> Iterator[Problem]:
        data = literal_of(value) if data is value else data
        for finding in check_payload(description, data, self._types.catalogue):
            place = self._module.span_of(value)
            message = finding.message.replace(description.name, in_python(description.name))
            yield Problem(finding.rule, message, place, finding.help)
