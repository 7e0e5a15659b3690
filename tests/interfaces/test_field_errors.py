import pytest

from composer.interfaces.field_errors import (
    describe_value,
    format_field_error,
    format_path,
    unknown_field,
)


@pytest.mark.parametrize(
    ('value', 'text'),
    [
        (None, 'None'),
        (5, 'int 5'),
        (True, 'bool True'),
        ('fast', "str 'fast'"),
        ({'x': 1}, "dict {'x': 1}"),
    ],
)
def test_a_value_is_described_by_type_and_content(value: object, text: str) -> None:
    assert describe_value(value) == text


def test_an_integer_that_python_refuses_to_print_is_described_by_its_size() -> None:
    assert describe_value(10**5000) == 'an integer of 16610 bits'


def test_a_long_value_is_shortened() -> None:
    assert len(describe_value('x' * 10_000)) < 100
    assert len(describe_value(list(range(10_000)))) < 100


def test_an_array_is_described_without_its_content() -> None:
    np = pytest.importorskip('numpy')
    assert describe_value(np.zeros((2, 3))) == 'ndarray of float64, shape (2, 3)'
    assert describe_value(np.int8(5)) == 'int8 np.int8(5)'


def test_a_path_is_written_as_code() -> None:
    assert format_path(()) == ''
    assert format_path(('pose', 'position', 'x')) == 'pose.position.x'
    assert format_path(('points', 3, 'y')) == 'points[3].y'


def test_an_error_names_message_and_field() -> None:
    assert format_field_error('a/msg/B', ('c', 0), 'wrong') == 'a/msg/B: c[0]: wrong'
    assert format_field_error('a/msg/B', (), 'a/msg/B has no field') == 'a/msg/B has no field'


def test_the_path_of_an_error_grows_from_the_inside() -> None:
    error = unknown_field('a/msg/B', 'x', [])
    assert error.path == ()
    assert error.within(3).within('points') is error
    assert error.path == ('points', 3)
