"""Parse definitions with `rosidl_adapter.parser`, the reference, into Composer's records.

Whatever it raises becomes a `DefinitionSyntaxError`.
"""

import importlib
from contextlib import redirect_stderr
from io import StringIO
from typing import Any

from composer.errors import ComposerError
from composer.interfaces.descriptions import (
    ArrayKind,
    ConstantDescription,
    FieldDescription,
    FieldType,
    MessageDescription,
)


class DefinitionSyntaxError(Exception):
    """`rosidl_adapter` refuses a definition."""


class ParserMissingError(ComposerError):
    """Definitions cannot be read: `rosidl_adapter` is not installed."""


def load_parser() -> Any:
    """Return `rosidl_adapter.parser`.

    Raises:
        ParserMissingError: it is not installed.
    """
    try:
        return importlib.import_module('rosidl_adapter.parser')
    except ImportError as error:
        message = 'interface definitions cannot be read: rosidl_adapter is not installed'
        raise ParserMissingError(
            message,
            help="install ROS, or pip install 'rclpy-composer[interfaces]'",
        ) from error


def parse_value(type_text: str, text: str) -> object:
    """Parse the value of a constant or the default of a field; an array becomes a tuple.

    Args:
        type_text: a type without errors, such as `int32[3]`.
        text: the value as written.

    Raises:
        DefinitionSyntaxError: the type cannot have that value.
    """
    parser = load_parser()
    try:
        field_type = parser.Type(type_text, context_package_name='any')
        return _plain_value(parser.parse_value_string(field_type, text))
    except parser.InvalidValue as error:
        raise DefinitionSyntaxError(str(error)) from error
    except NotImplementedError as error:
        message = f'a field of type {type_text} takes no default value'
        raise DefinitionSyntaxError(message) from error
    except (ValueError, IndexError) as error:
        message = f'{text!r} is not a value of type {type_text}'
        raise DefinitionSyntaxError(message) from error


def parse_message(package: str, name: str, text: str) -> MessageDescription:
    """Parse a whole message, or one part of a service or an action.

    Args:
        package: its package.
        name: its full name, such as `std_srvs/srv/SetBool_Request`.
        text: its definition.

    Raises:
        DefinitionSyntaxError: the reference parser refuses it.
    """
    parser = load_parser()
    try:
        # The parser prints what it is about to raise.
        with redirect_stderr(StringIO()):
            message = parser.parse_message_string(package, name.rpartition('/')[2], text)
    except Exception as error:
        raise DefinitionSyntaxError(str(error) or type(error).__name__) from error
    return MessageDescription(
        name,
        tuple(_field(field) for field in message.fields),
        tuple(_constant(constant) for constant in message.constants),
        _comment(message),
    )


def _field(field: Any) -> FieldDescription:
    default = None if field.default_value is None else _plain_value(field.default_value)
    return FieldDescription(field.name, _field_type(field.type), default, _comment(field))


def _constant(constant: Any) -> ConstantDescription:
    field_type = FieldType(constant.type)
    return ConstantDescription(constant.name, field_type, constant.value, _comment(constant))


def _field_type(rosidl_type: Any) -> FieldType:
    array: ArrayKind | None = None
    if rosidl_type.is_array:
        if rosidl_type.array_size is None:
            array = 'unbounded'
        else:
            array = 'bounded' if rosidl_type.is_upper_bound else 'fixed'
    nested = None
    if not rosidl_type.is_primitive_type():
        nested = f'{rosidl_type.pkg_name}/msg/{rosidl_type.type}'
    return FieldType(
        kind='message' if nested else rosidl_type.type,
        nested=nested,
        string_bound=rosidl_type.string_upper_bound,
        array=array,
        array_bound=rosidl_type.array_size,
    )


def _plain_value(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _comment(element: Any) -> str:
    """Return a comment with its unit such as `[m/s]`, which the parser cuts out."""
    text = '\n'.join(element.annotations.get('comment', ())).strip()
    unit = f'[{element.annotations["unit"]}]' if 'unit' in element.annotations else ''
    return text if unit in text else f'{text} {unit}'.strip()
