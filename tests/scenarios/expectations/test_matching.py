"""Messages are compared field by field, and only what differs is told."""

import copy
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.scenarios.expectations.diffs import render_differences
from composer.scenarios.expectations.matching import Comparison
from tests.scenarios.expectations.plain_messages import Number, Vector, number, scan


def diff(expected, actual, tolerance=0.0, ignored=()):
    comparison = Comparison(tolerance, frozenset(ignored))
    return render_differences(comparison.find_differences(expected, actual))


@pytest.mark.parametrize(
    ('expected', 'actual'),
    [
        ({}, scan()),
        ({'origin': {'x': 0.1}}, scan(0.1)),
        # What a field of 32 bits has left of it.
        ({'ranges': [0.2, 1]}, scan(ranges=[0.2, 1.0])),
        ({'ranges': [math.nan, math.inf]}, scan(ranges=[math.nan, math.inf])),
        ({'data': 3}, number(3.0)),
        (scan(1.0, [1.0]), scan(1.0, [1.0])),
        ([1, [2]], (1, [2.0])),
        (7, b'\x07'),
        (None, None),
    ],
)
def test_what_is_the_same_has_no_difference(expected, actual):
    assert diff(expected, actual) == ''


@pytest.mark.parametrize(
    ('expected', 'actual', 'lines'),
    [
        ({'origin': {'x': 1}}, scan(2.5), ['  origin:', '-   x: 1', '+   x: 2.5']),
        (
            {'origin': {'x': 1, 'y': 2}, 'frame': 'base'},
            scan(),
            ['  origin:', '-   x: 1', '+   x: 0.0', '-   y: 2', '+   y: 0.0',
             '- frame: "base"', '+ frame: "laser"'],
        ),
        (
            {'ranges': [1, 2]},
            scan(ranges=[1, 3, 4]),
            ['- ranges: 2 items', '+ ranges: 3 items', '  ranges:', '-   [1]: 2', '+   [1]: 3.0'],
        ),
        ({'rnages': 1}, scan(), ['- rnages: a field', '+ rnages: no such field']),
        (1, True, ['- 1', '+ true']),
        (math.inf, 1e308, ['- .inf', '+ 1e+308']),
        (scan(1.0), number(1.0), ['- Scan', '+ Number']),
        ({'a': 1}, {}, ['- a: 1', '+ a: nothing']),
        ('1', 1, ['- "1"', '+ 1']),
    ],
)  # fmt: skip
def test_only_what_differs_is_told(expected, actual, lines):
    assert diff(expected, actual).splitlines() == lines


def test_no_more_than_a_dozen_differences_are_told():
    lines = diff({f'{index}': index for index in range(20)}, {}).splitlines()
    assert len(lines) == 25
    assert lines[-1] == '  … and 8 more'


def test_fields_can_be_left_out():
    one, other = scan(1.0, [1.0], 'a'), scan(2.0, [2.0], 'b')
    lines = diff(one, other, ignored=[('origin', 'x'), ('ranges',)]).splitlines()
    assert lines == ['- frame: "a"', '+ frame: "b"']


FINITE = st.floats(-1e6, 1e6)


@given(FINITE, FINITE, st.sampled_from([0, 1e-9, 1e-3, 0.5, 2]))
def test_the_tolerance_is_absolute_or_relative_whichever_is_more(expected, actual, tolerance):
    is_near = abs(actual - expected) <= tolerance or (
        abs(actual - expected) <= tolerance * abs(expected)
    )
    assert (diff(expected, actual, tolerance) == '') == is_near


@given(st.floats(), st.floats())
def test_special_numbers_are_the_same_as_themselves_alone(one, other):
    is_same = one == other or (math.isnan(one) and math.isnan(other))
    assert (diff(one, other) == '') == is_same
    if math.isinf(one) or math.isinf(other) or math.isnan(one) or math.isnan(other):
        assert (diff(one, other, 1e300) == '') == is_same


LEAVES = st.one_of(st.integers(), st.booleans(), st.text(max_size=3), FINITE, st.none())
TREES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=2), inner, max_size=3),
    max_leaves=8,
)  # fmt: skip


def leaves(data, path=()):
    inner = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in inner:
        if isinstance(value, dict | list):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key)


@given(st.dictionaries(st.text(max_size=2), TREES, min_size=1, max_size=3), st.data())
def test_a_leaf_that_is_changed_is_the_difference(data, draw):
    assert list(Comparison().find_differences(data, copy.deepcopy(data))) == []
    places = list(leaves(data))
    if places:
        path = draw.draw(st.sampled_from(places))
        changed = copy.deepcopy(data)
        holder = changed
        for key in path[:-1]:
            holder = holder[key]
        holder[path[-1]] = 'something else'
        (found,) = Comparison().find_differences(data, changed)
        assert found.path == path


def test_messages_of_the_same_class_are_compared_in_all_fields():
    differences = Comparison().find_differences(Vector(x=1.0, y=2.0), Vector(x=1.0, y=3.0))
    assert [each.path for each in differences] == [('y',)]
    assert list(Comparison().find_differences(Number(data=1.0), Number(data=1.0))) == []


@pytest.mark.ros
def test_messages_of_ros_are_compared():
    from sensor_msgs.msg import CameraInfo, Imu

    imu = Imu()
    imu.linear_acceleration.z = 9.81
    assert diff({'linear_acceleration': {'z': 9.8}}, imu, 0.01) == ''
    assert diff({'linear_acceleration_covariance': [0.0] * 9}, imu) == ''
    assert diff(Imu(), imu).splitlines() == [
        '  linear_acceleration:',
        '-   z: 0.0',
        '+   z: 9.81',
    ]
    info = CameraInfo(k=[1.0] * 9)
    assert diff({'k': [1] * 9, 'header': {'stamp': {'sec': 0}}}, info) == ''
