"""What behaviours read and write of the message that they are given."""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING

from composer.interfaces.descriptions import FieldType, MessageDescription
from composer.interfaces.field_errors import unknown_field
from composer.interfaces.message_types import in_python
from composer.node_uses.literals import find_misfit
from composer.node_uses.reading import Problem
from composer.spelling import find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.interfaces.message_types import MessageTypes
    from composer.node_uses.reading import MessageUse, Reading
    from composer.node_uses.wires import Wire

_PYTHON_TYPES: dict[str, type] = {
    'bool': bool,
    'byte': bytes,
    'float32': float,
    'float64': float,
    'string': str,
    'wstring': str,
}
_INDEX = re.compile(r'\[(\d+)\]')
_OF_CLASSES = ('get_fields_and_field_types', 'SLOT_TYPES')


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
            if use.is_certain or (problem.help or '').startswith('did you mean'):
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
    for name in use.path:
        if isinstance(found, MessageDescription) and name[0] != '[':
            field = found.field(name)
            if field is None:
                return _unknown(types, found, name, use)
            if use.value is not None and name is use.path[-1]:
                return find_misfit(types, found, field, use.value, use.module)
            found = field.type
        elif isinstance(found, FieldType) and found.array and name[0] == '[':
            problem = _wrong_index(found, name, use)
            if problem is not None:
                return problem
            found = found.item
        else:
            return None
        if found.nested and not found.array:
            found = types.describe(found.nested)
    return _never_equal(found, use) if isinstance(found, FieldType) else None


def _wrong_index(array: FieldType, name: str, use: MessageUse) -> Problem | None:
    match = _INDEX.fullmatch(name)
    bound = array.array_bound if array.array == 'fixed' else None
    if match is None or bound is None or int(match[1]) < bound:
        return None
    text = f'there is no item {match[1]}: this has {bound}, from 0 to {bound - 1}'
    index = next(each for each in ast.walk(use.node) if isinstance(each, ast.Subscript)).slice
    return Problem('bad-index', text, use.module.span_of(index))


def _never_equal(field_type: FieldType, use: MessageUse) -> Problem | None:
    """Return that a field is compared with a constant of a type that it never has."""
    constant = use.compared.comparators[0] if use.compared else None
    if use.compared is None or not isinstance(constant, ast.Constant) or field_type.array:
        return None
    own = _PYTHON_TYPES.get(field_type.kind, int)
    other = type(constant.value)
    if other not in (bool, int, float, str, bytes) or {own, other} <= {bool, int, float}:
        return None
    if own is other:
        return None
    text = f'values of these types are never equal: {own.__name__} and {other.__name__}'
    return Problem('never-equal', text, use.module.span_of(use.compared))


def _unknown(
    types: MessageTypes, owner: MessageDescription, name: str, use: MessageUse
) -> Problem | None:
    if name.startswith('_') or name in _OF_CLASSES:
        return None
    known = types.constants(owner.name)
    shown, place = in_python(owner.name), use.module.span_of(use.node)
    place = place if place.text == name else place.narrowed_to(name)
    if name.isupper():
        if types.may_have_constant(owner.name, name):
            return None
        if find_nearest(name, known):
            text = f"{shown} has no constant '{name}'"
            return Problem('unknown-field', text, place, suggest(name, known, 'it has'))
    error = unknown_field(shown, name, [each.name for each in owner.fields])
    return Problem('unknown-field', str(error), place, error.help)
