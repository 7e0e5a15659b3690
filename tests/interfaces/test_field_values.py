from collections import deque
from enum import IntEnum
from math import inf

import pytest

from composer.interfaces.descriptions import FieldType
from composer.interfaces.field_errors import FieldError
from composer.interfaces.field_values import (
    FLOAT32_MAX,
    INTEGER_RANGES,
    check_length,
    read_items,
    scalar_reader,
)


class Colour(IntEnum):
    RED = 3


def failure(field_type: FieldType, value: object) -> tuple[str, str, str | None]:
    with pytest.raises(FieldError) as caught:
        scalar_reader(field_type)(value)
    return caught.value.rule, str(caught.value), caught.value.help


@pytest.mark.parametrize('kind', sorted(INTEGER_RANGES.keys() - {'byte'}))
def test_an_integer_must_fit_its_width(kind: str) -> None:
    low, high = INTEGER_RANGES[kind]
    read = scalar_reader(FieldType(kind))
    assert (read(low), read(high)) == (low, high)
    for value in (low - 1, high + 1):
        assert failure(FieldType(kind), value) == (
            'field-range',
            f'expected {kind} ({low} to {high}), got int {value}',
            None,
        )


def test_the_ranges_are_those_of_the_widths() -> None:
    assert INTEGER_RANGES['int8'] == (-128, 127)
    assert INTEGER_RANGES['uint8'] == INTEGER_RANGES['byte'] == INTEGER_RANGES['char'] == (0, 255)
    assert INTEGER_RANGES['int16'] == (-32768, 32767)
    assert INTEGER_RANGES['uint16'] == (0, 65535)
    assert INTEGER_RANGES['int32'] == (-2147483648, 2147483647)
    assert INTEGER_RANGES['uint32'] == (0, 4294967295)
    assert INTEGER_RANGES['int64'] == (-9223372036854775808, 9223372036854775807)
    assert INTEGER_RANGES['uint64'] == (0, 18446744073709551615)


@pytest.mark.parametrize(
    ('value', 'message', 'advice'),
    [
        (True, 'expected int32, got bool True', None),
        (5.0, 'expected int32, got float 5.0', 'write 5'),
        (5.5, 'expected int32, got float 5.5', None),
        (inf, 'expected int32, got float inf', None),
        ('5', "expected int32, got str '5'", 'write 5 without quotes'),
        ('-', "expected int32, got str '-'", None),
        ('five', "expected int32, got str 'five'", None),
        (None, 'expected int32, got None', None),
        ([5], 'expected int32, got list [5]', None),
    ],
)
def test_what_is_no_integer_is_refused(value: object, message: str, advice: str | None) -> None:
    assert failure(FieldType('int32'), value) == ('field-type', message, advice)


def test_an_enumeration_is_read_as_its_number() -> None:
    assert type(scalar_reader(FieldType('int32'))(Colour.RED)) is int
    assert scalar_reader(FieldType('float64'))(Colour.RED) == 3.0


@pytest.mark.parametrize('kind', ['float32', 'float64'])
@pytest.mark.parametrize('value', [0, 5, -(2**40), 1.5, inf, -inf])
def test_an_integer_becomes_a_float_where_one_is_wanted(kind: str, value: float) -> None:
    read = scalar_reader(FieldType(kind))(value)
    assert read == value
    assert type(read) is float


def test_a_finite_float_must_fit_its_width() -> None:
    read = scalar_reader(FieldType('float32'))
    assert (read(FLOAT32_MAX), read(-FLOAT32_MAX)) == (FLOAT32_MAX, -FLOAT32_MAX)
    for value in (1e39, -1e39):
        assert failure(FieldType('float32'), value) == (
            'field-range',
            f'expected float32 (up to 3.402823e+38), got float {value}',
            None,
        )
    for kind in ('float32', 'float64'):
        assert failure(FieldType(kind), 10**400) == (
            'field-range',
            f'expected {kind}, got an integer beyond its range',
            None,
        )


@pytest.mark.parametrize(
    ('value', 'message', 'advice'),
    [
        (True, 'expected float64, got bool True', None),
        ('1e3', "expected float64, got str '1e3'", 'write 1e3 without quotes'),
        ('fast', "expected float64, got str 'fast'", None),
        (None, 'expected float64, got None', None),
        (1j, 'expected float64, got complex 1j', None),
    ],
)
def test_what_is_no_float_is_refused(value: object, message: str, advice: str | None) -> None:
    assert failure(FieldType('float64'), value) == ('field-type', message, advice)


def test_only_booleans_are_booleans() -> None:
    read = scalar_reader(FieldType('bool'))
    assert read(True) is True
    assert read(False) is False
    assert failure(FieldType('bool'), 1) == (
        'field-type',
        'expected bool, got int 1',
        'write true or false',
    )
    assert failure(FieldType('bool'), None) == ('field-type', 'expected bool, got None', None)


@pytest.mark.parametrize('value', [255, b'\xff', bytearray(b'\xff')])
def test_a_byte_is_an_octet_or_its_number(value: object) -> None:
    read = scalar_reader(FieldType('byte'))(value)
    assert read == b'\xff'
    assert type(read) is bytes


@pytest.mark.parametrize(
    ('value', 'rule', 'message'),
    [
        (256, 'field-range', 'expected byte (0 to 255), got int 256'),
        (-1, 'field-range', 'expected byte (0 to 255), got int -1'),
        (b'ab', 'field-type', "expected byte, got bytes b'ab'"),
        (b'', 'field-type', "expected byte, got bytes b''"),
        ('a', 'field-type', "expected byte, got str 'a'"),
        (True, 'field-type', 'expected byte, got bool True'),
    ],
)
def test_what_is_no_octet_is_refused(value: object, rule: str, message: str) -> None:
    assert failure(FieldType('byte'), value) == (rule, message, None)


@pytest.mark.parametrize(
    ('value', 'message', 'advice'),
    [
        (5, 'expected string, got int 5', 'put it in quotes'),
        (True, 'expected string, got bool True', 'put it in quotes'),
        (None, 'expected string, got None', None),
        (b'x', "expected string, got bytes b'x'", None),
    ],
)
def test_what_is_no_text_is_refused(value: object, message: str, advice: str | None) -> None:
    assert failure(FieldType('string'), value) == ('field-type', message, advice)


def test_text_that_ros_would_change_is_refused() -> None:
    assert failure(FieldType('string'), 'a\0b') == (
        'field-text',
        'expected string, got text with a NUL character',
        'ROS would cut the text off there',
    )
    for kind in ('string', 'wstring'):
        assert failure(FieldType(kind), 'a\ud800') == (
            'field-text',
            f"expected {kind}, got text with a lone surrogate: str 'a\\ud800'",
            None,
        )
    assert scalar_reader(FieldType('wstring'))('a\0b') == 'a\0b'


def test_a_bound_counts_what_the_middleware_counts() -> None:
    narrow = FieldType('string', string_bound=4)
    assert scalar_reader(narrow)('abcd') == 'abcd'
    assert scalar_reader(narrow)('üü') == 'üü'
    assert failure(narrow, 'üüü') == (
        'field-length',
        'expected string<=4, got text of 6 bytes',
        None,
    )
    wide = FieldType('wstring', string_bound=4)
    assert scalar_reader(wide)('üü😀') == 'üü😀'
    assert failure(wide, 'üüü😀') == (
        'field-length',
        'expected wstring<=4, got text of 5 UTF-16 units',
        None,
    )


def test_numpy_scalars_count_as_what_they_hold() -> None:
    np = pytest.importorskip('numpy')
    assert type(scalar_reader(FieldType('int8'))(np.int64(5))) is int
    assert type(scalar_reader(FieldType('float64'))(np.float32(0.5))) is float
    assert type(scalar_reader(FieldType('float64'))(np.float64(0.5))) is float
    assert type(scalar_reader(FieldType('float64'))(np.uint8(5))) is float
    assert scalar_reader(FieldType('byte'))(np.uint8(5)) == b'\x05'
    assert scalar_reader(FieldType('bool'))(np.bool_(1)) is True
    assert failure(FieldType('int8'), np.int64(300))[0] == 'field-range'
    assert failure(FieldType('int8'), np.float64(5)) == (
        'field-type',
        'expected int8, got float64 np.float64(5.0)',
        'write 5',
    )
    assert failure(FieldType('float64'), np.bool_(1))[0] == 'field-type'
    assert failure(FieldType('bool'), np.int64(1))[0] == 'field-type'


@pytest.mark.parametrize('value', [[1], (1,), range(1), deque([1])])
def test_any_sequence_is_an_array(value: object) -> None:
    assert read_items(FieldType('int8', array='unbounded'), value) is value


@pytest.mark.parametrize('kind', ['byte', 'char', 'uint8'])
def test_bytes_are_an_array_of_octets(kind: str) -> None:
    assert list(read_items(FieldType(kind, array='unbounded'), b'ab')) == [97, 98]


@pytest.mark.parametrize(
    ('value', 'message', 'advice'),
    [
        (b'ab', "expected int8[], got bytes b'ab'", None),
        (5, 'expected int8[], got int 5', 'write it as a list'),
        ('ab', "expected int8[], got str 'ab'", 'write it as a list'),
        ({1, 2}, 'expected int8[], got set {1, 2}', None),
        ({'x': 1}, "expected int8[], got dict {'x': 1}", None),
        (None, 'expected int8[], got None', None),
    ],
)
def test_what_is_no_sequence_is_no_array(value: object, message: str, advice: str | None) -> None:
    with pytest.raises(FieldError) as caught:
        read_items(FieldType('int8', array='unbounded'), value)
    assert (caught.value.rule, str(caught.value), caught.value.help) == (
        'field-type',
        message,
        advice,
    )


@pytest.mark.parametrize(
    ('array', 'right', 'wrong'),
    [
        ('fixed', [3], [0, 2, 4]),
        ('bounded', [0, 2, 3], [4]),
        ('unbounded', [0, 3, 1000], []),
    ],
)
def test_the_length_of_an_array_is_checked(array: str, right: list[int], wrong: list[int]) -> None:
    bound = None if array == 'unbounded' else 3
    field_type = FieldType('int8', array=array, array_bound=bound)  # type: ignore[arg-type]
    for length in right:
        check_length(field_type, length)
    for length in wrong:
        with pytest.raises(FieldError) as caught:
            check_length(field_type, length)
        assert caught.value.rule == 'field-length'
        assert str(caught.value) == f'expected {field_type}, got {length} items'
