"""The values that a field can hold: one set of rules for checks and for conversions.

A rule reads a value and returns it in the form that rclpy's generated classes keep, or raises
`FieldError`. The rules:

- A field of floats takes integers. A field of integers takes no floats, not even integral ones,
  and no field of numbers takes a bool: these are mistakes more often than not.
- Integers and finite floats have to fit their width; infinities and NaN are values.
- A `byte` is an integer from 0 to 255 or one byte; rclpy keeps it as one byte.
- A string's bound counts bytes of UTF-8, as the middleware does (UTF-16 units for a `wstring`).
  A `string` must not contain NUL, where rclpy would cut it off, nor lone surrogates, which have no
  encoding.
- NumPy's scalars count as the Python values that they hold.

rclpy does not check fields by default: an `int` in a `float64` field is published as garbage. A
value that a rule returns is safe to publish.
"""

from collections.abc import Callable, Sequence
from math import isfinite
from typing import Final, TypeAlias

from composer.interfaces.descriptions import FieldType
from composer.interfaces.field_errors import FieldError, describe_value, wrong_type

Reader: TypeAlias = Callable[[object], object]

INTEGER_RANGES: Final = {
    'byte': (0, 2**8 - 1),
    'char': (0, 2**8 - 1),
    'int8': (-(2**7), 2**7 - 1),
    'uint8': (0, 2**8 - 1),
    'int16': (-(2**15), 2**15 - 1),
    'uint16': (0, 2**16 - 1),
    'int32': (-(2**31), 2**31 - 1),
    'uint32': (0, 2**32 - 1),
    'int64': (-(2**63), 2**63 - 1),
    'uint64': (0, 2**64 - 1),
}
# The greatest finite single-precision number (IEEE 754 binary32).
FLOAT32_MAX: Final = (2 - 2**-23) * 2.0**127
BYTES: Final = tuple(bytes([number]) for number in range(256))
IN_QUOTES: Final = 'put it in quotes'
OCTET_KINDS: Final = frozenset({'byte', 'char', 'uint8'})


def scalar_reader(field_type: FieldType) -> Reader:
    """Return the rule for single values of a type, or for the items of an array of it.

    Args:
        field_type: any but a message.
    """
    match field_type.kind:
        case 'bool':
            return _read_bool
        case 'byte':
            return _read_byte
        case 'float64':
            return _read_float64
        case 'float32':
            return _read_float32
        case 'string' | 'wstring':
            return _string_reader(field_type.item)
        case _:
            return _integer_reader(field_type.kind)


def read_items(field_type: FieldType, value: object) -> Sequence[object]:
    """Return the items of an array; they are not checked yet.

    Raises:
        FieldError: the value is not a sequence, or is a string, or bytes for other items.
    """
    if isinstance(value, list | tuple):
        return value
    if isinstance(value, bytes | bytearray):
        if field_type.kind in OCTET_KINDS:
            return value
    elif isinstance(value, Sequence) and not isinstance(value, str | memoryview):
        return value
    scalar = isinstance(value, str | int | float)
    raise wrong_type(field_type, value, 'write it as a list' if scalar else None)


def check_length(field_type: FieldType, length: int) -> None:
    """Check the number of items of an array.

    Raises:
        FieldError: a fixed array has another number of items, or a bounded one has more.
    """
    bound = field_type.array_bound
    if bound is None or length == bound or (length < bound and field_type.array == 'bounded'):
        return
    items = '1 item' if length == 1 else f'{length} items'
    message = f'expected {field_type}, got {items}'
    raise FieldError(message, rule='field-length')


def _plain(value: object) -> object:
    """Return the Python value that a NumPy scalar holds, without importing NumPy."""
    if type(value).__module__ == 'numpy' and getattr(value, 'shape', None) == ():
        return value.item()  # type: ignore[attr-defined]
    return value


def _read_bool(value: object) -> object:
    if value is True or value is False:
        return value
    plain = _plain(value)
    if isinstance(plain, bool):
        return plain
    advice = 'write true or false' if isinstance(value, str | int) else None
    raise wrong_type(FieldType('bool'), value, advice)


def _read_integer(expected: FieldType, value: object) -> int:
    plain = _plain(value)
    if isinstance(plain, int) and not isinstance(plain, bool):
        return int(plain)
    advice = None
    if isinstance(plain, float) and plain.is_integer():
        advice = f'write {int(plain)}'
    elif isinstance(value, str) and value.strip().lstrip('+-').isdecimal():
        advice = f'write {value.strip()} without quotes'
    raise wrong_type(expected, value, advice)


def _integer_reader(kind: str) -> Callable[[object], int]:
    low, high = INTEGER_RANGES[kind]
    expected = FieldType(kind)

    def read(value: object) -> int:
        number = value if type(value) is int else _read_integer(expected, value)
        if low <= number <= high:
            return number
        message = f'expected {expected} ({low} to {high}), got {describe_value(value)}'
        raise FieldError(message, rule='field-range')

    return read


_read_octet: Final = _integer_reader('byte')


def _read_byte(value: object) -> object:
    if isinstance(value, bytes | bytearray) and len(value) == 1:
        return value if type(value) is bytes else BYTES[value[0]]
    return BYTES[_read_octet(value)]


def _read_float(expected: FieldType, value: object) -> float:
    plain = _plain(value)
    if isinstance(plain, float | int) and not isinstance(plain, bool):
        try:
            return float(plain)
        except OverflowError:
            message = f'expected {expected}, got an integer beyond its range'
            raise FieldError(message, rule='field-range') from None
    advice = None
    if isinstance(value, str) and _is_number(value):
        advice = f'write {value.strip()} without quotes'
    raise wrong_type(expected, value, advice)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


_FLOAT64: Final = FieldType('float64')
_FLOAT32: Final = FieldType('float32')


def _read_float64(value: object) -> object:
    return value if type(value) is float else _read_float(_FLOAT64, value)


def _read_float32(value: object) -> object:
    number = value if type(value) is float else _read_float(_FLOAT32, value)
    if -FLOAT32_MAX <= number <= FLOAT32_MAX or not isfinite(number):
        return number
    message = f'expected float32 (up to {FLOAT32_MAX:.7g}), got {describe_value(value)}'
    raise FieldError(message, rule='field-range')


def _string_reader(expected: FieldType) -> Reader:
    wide = expected.kind == 'wstring'
    bound = expected.string_bound

    def read(value: object) -> object:
        if not isinstance(value, str):
            scalar = isinstance(value, bool | int | float)
            raise wrong_type(expected, value, IN_QUOTES if scalar else None)
        if not wide and '\0' in value:
            message = f'expected {expected}, got text with a NUL character'
            advice = 'ROS would cut the text off there'
            raise FieldError(message, rule='field-text', help=advice)
        if bound is not None or not value.isascii():
            _check_text(expected, value)
        # The text alone, of a string of another class.
        return value if type(value) is str else str.__str__(value)

    return read


def _check_text(expected: FieldType, value: str) -> None:
    wide = expected.kind == 'wstring'
    try:
        size = len(value.encode('utf-16-le')) // 2 if wide else len(value.encode())
    except UnicodeEncodeError:
        message = f'expected {expected}, got text with a lone surrogate: {describe_value(value)}'
        raise FieldError(message, rule='field-text') from None
    if expected.string_bound is not None and size > expected.string_bound:
        unit = 'UTF-16 units' if wide else 'bytes'
        message = f'expected {expected}, got text of {size} {unit}'
        raise FieldError(message, rule='field-length')
