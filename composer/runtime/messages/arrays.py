"""Arrays in payloads → the containers of rclpy's message classes.

These are an `array.array` for sequences of numbers, a NumPy array for a fixed count of numbers,
and a list for everything else. The input may be any sequence, a NumPy array (of several dimensions
too, in row-major order, as ROS lays out its matrices) or an `array.array`; for octets also
`bytes`, `bytearray` or a `memoryview` of octets.

Numbers that are in their container already are not checked again: a message costs the same whether
its image has ten pixels or a million. Lists are checked, since anything may be in them.
"""

from array import array
from collections.abc import Callable, Sequence
from math import isfinite
from operator import is_
from typing import Any, Final, TypeAlias

from composer.interfaces.descriptions import FieldType
from composer.interfaces.field_errors import FieldError
from composer.interfaces.field_values import OCTET_KINDS, Reader, check_length, read_items

_SequenceReader: TypeAlias = Callable[[object], Sequence[Any]]

# The type codes of `array` in rosidl_generator_py, which `struct` has, too.
TYPE_CODES: Final = {
    'char': 'B',
    'int8': 'b',
    'uint8': 'B',
    'int16': 'h',
    'uint16': 'H',
    'int32': 'i',
    'uint32': 'I',
    'int64': 'q',
    'uint64': 'Q',
    'float32': 'f',
    'float64': 'd',
}
_FLOAT_CODES: Final = frozenset({'f', 'd'})
_OCTET_FORMATS: Final = frozenset({'B', 'c'})


def is_numpy_array(field_type: FieldType) -> bool:
    """Tell whether the values of a field are NumPy arrays."""
    return field_type.array == 'fixed' and field_type.kind in TYPE_CODES


def is_number_array(field_type: FieldType) -> bool:
    """Tell whether a field has an array of numbers, of NumPy or an `array.array`."""
    return field_type.array is not None and field_type.kind in TYPE_CODES


def array_reader(field_type: FieldType, read_item: Reader) -> Reader:
    """Return the function that reads arrays of a type.

    Args:
        field_type: The type of the array.
        read_item: Reads its items.
    """
    read_list = _list_reader(field_type, read_item)
    if field_type.kind not in TYPE_CODES:
        return read_list
    read_numbers = _number_reader(field_type, read_list)
    if field_type.array != 'fixed':
        return read_numbers
    # NumPy takes a tenth of a second to import, and most messages do not need it. The class of a
    # message with a fixed array of numbers has imported it already.
    from composer.runtime.messages.numpy_arrays import fixed_reader

    return fixed_reader(field_type, read_numbers)


def _list_reader(field_type: FieldType, read_item: Reader) -> _SequenceReader:
    def read(value: object) -> Sequence[object]:
        items = read_items(field_type, _unpack(value))
        check_length(field_type, len(items))
        kept: list[object] = []
        try:
            for item in items:
                kept.append(read_item(item))  # noqa: PERF401
        except FieldError as error:
            error.within(len(kept))
            raise
        # A list that needs no change stays the same object.
        return value if type(value) is list and all(map(is_, kept, value)) else kept

    return read


def _number_reader(field_type: FieldType, read_list: _SequenceReader) -> Reader:
    code = TYPE_CODES[field_type.kind]

    def read(value: object) -> 'array[Any]':
        if type(value) is array and value.typecode == code:
            check_length(field_type, len(value))
            return value
        numbers = _copy_fast(field_type.kind, value)
        if numbers is None:
            return array(code, read_list(value))
        check_length(field_type, len(numbers))
        return numbers

    return read


def _copy_fast(kind: str, value: object) -> 'array[Any] | None':
    """Return a copy of numbers that are valid as a whole, None if each must be checked."""
    code = TYPE_CODES[kind]
    if isinstance(value, list | tuple):
        return _copy_list(code, value)
    if isinstance(value, memoryview) and value.format == code:
        return array(code, value.tobytes())
    octets = _unpack(value) if isinstance(value, memoryview) else value
    if kind in OCTET_KINDS and isinstance(octets, bytes | bytearray):
        return array(code, octets)
    if hasattr(value, '__array_interface__'):
        # Only NumPy's arrays get here, so NumPy is imported already.
        from composer.runtime.messages.numpy_arrays import read_array

        exact = read_array(kind, value)
        return None if exact is None else array(code, exact.tobytes())
    return None


def _copy_list(code: str, value: 'list[Any] | tuple[Any, ...]') -> 'array[Any] | None':
    kinds = set(map(type, value))
    if not kinds <= ({int, float} if code in _FLOAT_CODES else {int}):
        return None
    try:
        numbers = array(code, value)
    except OverflowError:
        return None
    # A finite number beyond the range of a float32 has become infinite.
    return None if code == 'f' and not all(map(isfinite, numbers)) else numbers


def _unpack(value: Any) -> object:
    """Return arrays of NumPy and `array.array` as lists, and views of octets as bytes."""
    if isinstance(value, memoryview):
        return value.tobytes() if value.format in _OCTET_FORMATS else value
    if isinstance(value, array):
        return value.tolist()
    if hasattr(value, '__array_interface__'):
        # NumPy's scalars and arrays without dimensions are single values here.
        return value.reshape(-1).tolist() if value.shape else value.item()
    return value
