"""Read the type descriptions that installed packages carry, as `share/<package>/msg/<Name>.json`.

`rosidl_generator_type_description` writes one such file per interface, with everything the
interface refers to. The numbers are those of `type_description_interfaces/msg/FieldType`.
https://github.com/ros-infrastructure/rep/pull/381 (REP 2011) has the format.
"""

from ast import literal_eval
from typing import Any, Final

from composer.errors import ComposerError
from composer.interfaces.descriptions import (
    ActionDescription,
    ArrayKind,
    FieldDescription,
    FieldType,
    InterfaceDescription,
    MessageDescription,
    ServiceDescription,
)

EMPTY_MESSAGE_FIELD: Final = 'structure_needs_at_least_one_member'

# Absent are the types that only IDL can express: long double (12), char (13), wchar (14) and
# strings of a fixed length (19, 20). A .msg `char` is described as the uint8 that it is.
_KINDS: Final = {
    1: 'message',
    2: 'int8',
    3: 'uint8',
    4: 'int16',
    5: 'uint16',
    6: 'int32',
    7: 'uint32',
    8: 'int64',
    9: 'uint64',
    10: 'float32',
    11: 'float64',
    15: 'bool',
    16: 'byte',
    17: 'string',
    18: 'wstring',
    21: 'string',
    22: 'wstring',
}
_BOUNDED_STRINGS: Final = frozenset({21, 22})
# The kind of array is added to the number of the item's type.
_ARRAY_STEP: Final = 48
_ARRAYS: Final[tuple[ArrayKind | None, ...]] = (None, 'fixed', 'bounded', 'unbounded')
# What reading a document of another shape raises.
_MALFORMED: Final = (AttributeError, LookupError, SyntaxError, TypeError, ValueError)


class TypeDescriptionError(ComposerError):
    """A document is not a type description, or has types that `.msg` files do not have."""


def parse_type_description(document: dict[str, Any]) -> InterfaceDescription:
    """Return the interface that a JSON document describes.

    Raises:
        TypeDescriptionError: the document is not a type description, or a field has a type that
            only IDL can express.
    """
    try:
        return _parse_interface(document)
    except _MALFORMED as error:
        message = f'not a type description: {error!r}'
        raise TypeDescriptionError(message) from error


def _parse_interface(document: dict[str, Any]) -> InterfaceDescription:
    content = document['type_description_msg']
    described = content['type_description']
    name: str = described['type_name']
    kind = name.split('/')[1]
    if kind == 'msg':
        return _parse_message(described)
    parts = {part['type_name']: part for part in content['referenced_type_descriptions']}

    def parse_part(suffix: str) -> MessageDescription:
        return _parse_message(parts[f'{name}_{suffix}'])

    if kind == 'srv':
        return ServiceDescription(name, parse_part('Request'), parse_part('Response'))
    return ActionDescription(
        name,
        parse_part('Goal'),
        parse_part('Result'),
        parse_part('Feedback'),
    )


def _parse_message(described: dict[str, Any]) -> MessageDescription:
    fields = tuple(
        _parse_field(field)
        for field in described['fields']
        if field['name'] != EMPTY_MESSAGE_FIELD
    )
    return MessageDescription(described['type_name'], fields)


def _parse_field(described: dict[str, Any]) -> FieldDescription:
    field_type = _parse_type(described['type'])
    default = _parse_default(field_type, described.get('default_value', ''))
    return FieldDescription(described['name'], field_type, default)


def _parse_type(described: dict[str, Any]) -> FieldType:
    array_number, number = divmod(described['type_id'] - 1, _ARRAY_STEP)
    number += 1
    if number not in _KINDS:
        message = f'type {described["type_id"]} has no place in .msg files'
        raise TypeDescriptionError(message)
    array = _ARRAYS[array_number]
    return FieldType(
        kind=_KINDS[number],
        nested=described['nested_type_name'] or None,
        string_bound=described['string_capacity'] if number in _BOUNDED_STRINGS else None,
        array=array,
        array_bound=described['capacity'] if array in {'fixed', 'bounded'} else None,
    )


def _parse_default(field_type: FieldType, text: str) -> object | None:
    if not text:
        return None
    if field_type.array is None and field_type.kind in {'string', 'wstring'}:
        return text
    value: object = literal_eval(text)
    return value
