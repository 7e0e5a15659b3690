"""The types of ROS parameters, and which values they take."""

import pytest

from composer.ros_parameters.parameter_types import (
    PARAMETER_TYPES,
    convert_parameter_value,
    find_type_problem,
    find_type_problems,
    infer_parameter_type,
)


@pytest.mark.ros
def test_the_types_are_rclpys_own():
    from rclpy.parameter import Parameter

    assert set(PARAMETER_TYPES) == {
        kind.name.lower() for kind in Parameter.Type if kind is not Parameter.Type.NOT_SET
    }


@pytest.mark.parametrize(
    ('value', 'type_name'),
    [
        (True, 'bool'),
        (1, 'integer'),
        (1.0, 'double'),
        ('1', 'string'),
        ([1], 'integer_array'),
        ([1, 1.5], 'double_array'),
        ([], None),
        ([1, True], None),
        ([None], None),
        ({}, None),
    ],
)
def test_a_value_tells_its_type(value, type_name):
    assert infer_parameter_type(value) == type_name


@pytest.mark.parametrize(
    ('value', 'type_name', 'converted'),
    [
        (1, 'double', 1.0),
        ([1, 2.5], 'double_array', [1.0, 2.5]),
        (True, 'double', True),
        ([True], 'double_array', [True]),
        (1, 'integer', 1),
        (1.0, 'integer', 1.0),
        ('1', 'double', '1'),
        (None, 'double', None),
        (3, 'double_array', 3),
    ],
)
def test_integers_become_doubles_where_doubles_are_wanted(value, type_name, converted):
    assert repr(convert_parameter_value(value, type_name)) == repr(converted)


@pytest.mark.parametrize(
    ('value', 'type_name'),
    [
        (False, 'bool'),
        (2**63 - 1, 'integer'),
        (1, 'double'),
        (float('nan'), 'double'),
        ([], 'bool_array'),
        ([0, 255], 'byte_array'),
        ([1, 2.5], 'double_array'),
    ],
)
def test_a_value_of_its_type_has_no_finding(value, type_name):
    assert find_type_problem(value, type_name) is None
    assert list(find_type_problems(value, type_name)) == []


@pytest.mark.parametrize(
    ('value', 'type_name', 'finding'),
    [
        (1, 'bool', 'expected a bool, got 1'),
        (True, 'integer', 'expected an integer, got True'),
        (True, 'double', 'expected a double, got True'),
        (1, 'string', 'expected a string, got 1'),
        (2**63, 'integer', '9223372036854775808 does not fit in 64 bits'),
        (-(2**63) - 1, 'integer', '-9223372036854775809 does not fit in 64 bits'),
        ('ab', 'string_array', "expected a list of string values, got 'ab'"),
        ([0, 256], 'byte_array', 'item 1: expected a byte (0 to 255), got 256'),
        ([-1], 'byte_array', 'item 0: expected a byte (0 to 255), got -1'),
        ([None], 'string_array', 'item 0: expected a string, got None'),
    ],
)
def test_a_value_of_another_type_says_what_was_expected(value, type_name, finding):
    assert find_type_problem(value, type_name) == finding
