"""Describe the fields of a generated message class from its `SLOT_TYPES`.

This needs no type description, but the class has to be imported.
"""

from typing import Any, Final

from rosidl_parser import definition as idl

from composer.errors import ComposerError
from composer.interfaces.classes import interface_name
from composer.interfaces.descriptions import (
    ArrayKind,
    FieldDescription,
    FieldType,
    MessageDescription,
)
from composer.interfaces.type_descriptions import EMPTY_MESSAGE_FIELD

# The IDL names of the types whose .msg name differs (see rosidl_adapter).
_MSG_NAMES: Final = {
    'boolean': 'bool',
    'octet': 'byte',
    'float': 'float32',
    'double': 'float64',
}
_IDL_ONLY: Final = frozenset({'char', 'wchar', 'long double'})


class UnsupportedFieldError(ComposerError):
    """A message has a field of a type that `.msg` files do not have."""


def describe_class(message_class: type) -> MessageDescription:
    """Describe a generated message class, without default values, constants and comments.

    Args:
        message_class: the class of a message, request, response, goal, result or feedback.

    Raises:
        UnsupportedFieldError: a field has a type that only IDL can express.
    """
    generated: Any = message_class
    name = interface_name(message_class)
    names = generated.get_fields_and_field_types()
    fields = tuple(
        FieldDescription(field, _field_type(f'{name}.{field}', slot))
        for field, slot in zip(names, generated.SLOT_TYPES, strict=True)
        if field != EMPTY_MESSAGE_FIELD
    )
    return MessageDescription(name, fields)


def _field_type(place: str, slot: idl.AbstractType) -> FieldType:
    match slot:
        case idl.Array():
            return _array_of(_item_type(place, slot.value_type), 'fixed', slot.size)
        case idl.BoundedSequence():
            return _array_of(_item_type(place, slot.value_type), 'bounded', slot.maximum_size)
        case idl.UnboundedSequence():
            return _array_of(_item_type(place, slot.value_type), 'unbounded', None)
        case _:
            return _item_type(place, slot)


def _array_of(item: FieldType, array: ArrayKind, bound: int | None) -> FieldType:
    return FieldType(item.kind, item.nested, item.string_bound, array, bound)


def _item_type(place: str, slot: idl.AbstractNestableType) -> FieldType:
    match slot:
        case idl.NamespacedType():
            return FieldType('message', nested='/'.join((*slot.namespaces, slot.name)))
        case idl.AbstractGenericString():
            kind = 'wstring' if isinstance(slot, idl.AbstractWString) else 'string'
            return FieldType(kind, string_bound=getattr(slot, 'maximum_size', None))
        case idl.BasicType() if slot.typename not in _IDL_ONLY:
            return FieldType(_MSG_NAMES.get(slot.typename, slot.typename))
    unknown = getattr(slot, 'typename', type(slot).__name__)
    message = f'{place} is of the IDL type {unknown!r}, which .msg files do not have'
    raise UnsupportedFieldError(message, help='use a type that .msg files have')
