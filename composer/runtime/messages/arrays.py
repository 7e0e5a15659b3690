"""Arrays in payloads become the containers that rclpy's generated classes keep.

Those are an `array.array` for sequences of numbers, a NumPy array for numbers of a fixed count,
and a list for all else. Any sequence will do as input, and so do NumPy's arrays (of more than one
dimension too, in row-major order, as ROS lays out its matrices) and `array.array`; where the items
are octets, so do `bytes`, `bytearray` and a `memoryview` of octets.

Numbers in their container already are not looked into again, so that checking a message costs the
same whether its image has ten pixels or a million. Lists are, since anything may be in them.
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

# The `array` type codes of rosidl_generator_py.
_TYPE_CODES: Final = {
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


def array_reader(field_type: FieldType, read_item: Reader) -> Reader:
    """Get the rule for arrays of a type.

    Args:
        field_type: the type of the array.
        read_item: the rule for its items.
    """
    read_list = _list_reader(field_type, read_item)
    if field_type.kind not in _TYPE_CODES:
        return read_list
    read_numbers = _number_reader(field_type, read_list)
    if field_type.array != 'fixed':
        return read_numbers
    # NumPy takes a tenth of a second to import, and most messages do without it. The class of one
    # with a fixed array of numbers has imported it by now.
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
    code = _TYPE_CODES[field_type.kind]

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
    """Copy numbers that are right as a whole, or return None where each must be looked at."""
    code = _TYPE_CODES[kind]
    if isinstance(value, list | tuple):
        return _copy_list(code, value)
    octets = _unpack(value) if isinstance(value, memoryview) else value
    if kind in OCTET_KINDS and isinstance(octets, bytes | bytearray):
        return array(code, octets)
    if hasattr(value, '__array_interface__'):
        # Only NumPy's arrays get here, so it is imported already.
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
    # A finite number beyond the range of a float32 would be infinite by now.
    return None if code == 'f' and not all(map(isfinite, numbers)) else numbers


def _unpack(value: Any) -> object:
    """Get the items of NumPy's arrays and `array.array` as Python values, views as their bytes."""
    if isinstance(value, memoryview):
        return value.tobytes() if value.format in _OCTET_FORMATS else value
    if isinstance(value, array):
        return value.tolist()
    if hasattr(value, '__array_interface__'):
        # NumPy's scalars and arrays of no dimension are no arrays here: they remain single values.
        return value.reshape(-1).tolist() if value.shape else value.item()
    return value
