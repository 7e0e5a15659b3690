"""Scalars of parameter files have the types that rcl gives them."""

import math

import pytest

from composer.ros_parameters.rcl_values import read_plain_scalar

CASES = {
    'yes': True,
    'y': True,
    'off': False,
    'oN': 'oN',
    '5': 5,
    '-0': 0,
    '0x1F': 31,
    '010': 8,
    '08': 8.0,
    '1_000': '1_000',
    '9223372036854775807': 9223372036854775807,
    '9223372036854775808': 9.223372036854775808e18,
    '1.': 1.0,
    '1e5': 1e5,
    '0x1.8p3': 12.0,
    '1e400': '1e400',
    '1e-310': '1e-310',
    '0x1p-1074': 5e-324,
    '0x1p9999': '0x1p9999',
    '1e-999': '1e-999',
    'inf': math.inf,
    '.inf': math.inf,
    '-.INF': -math.inf,
    'null': 'null',
    '12:30': '12:30',
    'text': 'text',
}


@pytest.mark.parametrize(('text', 'value'), CASES.items())
def test_a_scalar_has_the_type_that_rcl_gives_it(text, value):
    read = read_plain_scalar(text)
    assert (type(read), read) == (type(value), value)


@pytest.mark.parametrize('text', ['.nan', '.NaN', 'nan', 'NAN', 'nan(1)'])
def test_a_nan_is_a_double(text):
    assert math.isnan(read_plain_scalar(text))


@pytest.mark.parametrize('digit', ['7', '0x7', '1.7', '0x1.7'])
def test_endless_digits_are_read_in_no_time(digit):
    assert isinstance(read_plain_scalar(digit + '7' * 100_000), str | float)
