"""How values, paths and faults of fields are worded in messages to people."""

from collections.abc import Iterable
from reprlib import Repr
from typing import Final

# Beyond this no field can hold an integer, and its digits say nothing (Python may refuse to print
# them: `sys.set_int_max_str_digits`).
LONG_INTEGER_BITS: Final = 128
_SHORT: Final = Repr()
_SHORT.maxstring = _SHORT.maxother = 60


def interface_name(interface: type) -> str:
    """Get the full name of a generated class, such as `std_msgs/msg/String`.

    The parts of services and actions are named as their descriptions are:
    `std_srvs/srv/SetBool_Request`.
    """
    package, kind, *_ = interface.__module__.split('.')
    return f'{package}/{kind}/{interface.__name__}'


def is_message_class(interface: type) -> bool:
    """Tell the classes that rclpy's generator makes of messages from all others."""
    return hasattr(interface, 'get_fields_and_field_types')


def describe_value(value: object) -> str:
    """Describe a value briefly: its type, and what it is where that helps."""
    if value is None:
        return 'None'
    if is_message_class(type(value)):
        return interface_name(type(value))
    if isinstance(value, int) and value.bit_length() > LONG_INTEGER_BITS:
        return f'an integer of {value.bit_length()} bits'
    dtype, shape = getattr(value, 'dtype', None), getattr(value, 'shape', ())
    if dtype is not None and shape:
        return f'{type(value).__name__} of {dtype}, shape {shape}'
    return f'{type(value).__name__} {_SHORT.repr(value)}'


def format_path(path: Iterable[str | int]) -> str:
    """Write a path as code would: `points[3].y`."""
    text = ''
    for key in path:
        if isinstance(key, int):
            text += f'[{key}]'
        else:
            text += f'.{key}' if text else key
    return text


def format_fault(message_name: str, path: tuple[str | int, ...], fault: str) -> str:
    """Say where in a message a fault lies; faults of the message itself name it already."""
    return f'{message_name}: {format_path(path)}: {fault}' if path else fault
