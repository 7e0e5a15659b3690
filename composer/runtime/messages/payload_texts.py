"""Payloads as people write them, in YAML → messages and parameters."""

from __future__ import annotations

from textwrap import indent
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError, UsageError
from composer.yaml_text.reader import parse_document

if TYPE_CHECKING:
    from rcl_interfaces.msg import Parameter

# Of rcl_interfaces/msg/ParameterType: these take whole numbers, too.
_DOUBLE, _DOUBLES = 3, 8


def read_payload(text: str, message_class: type) -> Any:
    """Return the message of a payload, checked as one in a file.

    Raises:
        UsageError: It is no YAML.
        PayloadError: It does not fit.
    """
    from composer.runtime.messages.payloads import converter_for

    return converter_for(message_class).convert(_parse(text))


def read_parameter(name: str, text: str, parameter_type: int) -> Parameter:
    """Return a parameter with the value that a text has.

    Args:
        parameter_type: Its type, as in `rcl_interfaces/msg/ParameterType`.

    Raises:
        UsageError: It is no YAML.
        ComposerError: It is no value of a parameter.
    """
    return create_parameter(name, _parse(text), parameter_type)


def create_parameter(name: str, value: Any, parameter_type: int) -> Parameter:
    """Return a parameter; where its type has floats, the value may have whole numbers.

    Raises:
        ComposerError: It is no value of a parameter.
    """
    from rclpy.parameter import Parameter

    try:
        return Parameter(name, value=_fit(value, parameter_type)).to_parameter_msg()
    except (AttributeError, TypeError, ValueError, AssertionError):
        message = f'{value} is no value of a parameter'
        raise ComposerError(message) from None


def _fit(value: Any, parameter_type: int) -> Any:
    if parameter_type == _DOUBLE and type(value) is int:
        return float(value)
    if parameter_type == _DOUBLES and isinstance(value, list):
        return [float(each) if type(each) is int else each for each in value]
    return value


def _parse(text: str) -> Any:
    if not text.strip():
        return {}
    block = f'value: {text}\n' if '\n' not in text else f'value:\n{indent(text, "  ")}\n'
    document = parse_document(block.encode(), 'the payload')
    if document.data is None or document.diagnostics:
        finding = document.diagnostics[0]
        message = f"'{text}' is no YAML: {finding.message}"
        raise UsageError(message, help=finding.help)
    return document.data['value']
