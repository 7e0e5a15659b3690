"""Parameter files that Composer writes, which rcl reads back as the same values."""

import math
from types import MappingProxyType

import pytest

from composer.ros_parameters.file_reader import parse_parameter_file
from composer.ros_parameters.file_writer import render_parameters_for_all


def test_integers_among_doubles_are_written_as_doubles():
    parameters = MappingProxyType({'f': [1, 2.5], 'g': {'h': [1, 2]}})
    text = render_parameters_for_all(parameters)
    assert text == '"/**":\n  ros__parameters:\n    f: [1.0, 2.5]\n    g:\n      h: [1, 2]\n'


@pytest.mark.parametrize(
    'value',
    ['', 'on', '1', '0x10', '.inf', '{{ x }}', 'a\u0007\n"\u2028', True, 3, 3.0, 5e-324, -math.inf, 1e300, ['yes', 'no']],
)  # fmt: skip
def test_values_keep_their_types(value):
    (entry,) = parse_parameter_file(render_parameters_for_all({'yes': value}), 'x').entries
    assert (entry.pattern, entry.name) == ('/**', 'yes')
    assert (entry.value, type(entry.value)) == (value, type(value))
