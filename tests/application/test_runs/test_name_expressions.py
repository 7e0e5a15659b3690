"""Expressions of `-k` mean what they mean to pytest."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.application.test_runs.name_expressions import parse_name_expression
from composer.errors import UsageError

NAME = 'tests/robot.scenario.yaml::stops at an obstacle'


@pytest.mark.parametrize(
    ('text', 'is_meant'),
    [
        ('stops', True),
        ('robot.scenario', True),
        ('starts', False),
        ('not starts', True),
        ('stops and starts', False),
        ('starts or stops', True),
        ('not (starts or stops)', False),
        ('starts and stops or obstacle', True),
        ("'stops at an'", True),
    ],
)
def test_words_are_parts_of_names(text, is_meant):
    assert parse_name_expression(text)(NAME) is is_meant


@pytest.mark.parametrize(
    ('text', 'problem'),
    [
        ('', 'a name is missing at its end'),
        ('stops and', 'a name is missing at its end'),
        ('or stops', "a name is missing before 'or'"),
        ('(stops', "')' is missing"),
        ('stops)', "')' is unexpected"),
        ('stops starts', "'starts' is unexpected"),
        ('stops & starts', "'&' is unexpected"),
    ],
)
def test_what_is_no_expression_is_refused(text, problem):
    with pytest.raises(UsageError) as error:
        parse_name_expression(text)
    assert str(error.value) == f"-k '{text}': {problem}"


_names = st.sampled_from(['a', 'b', 'c'])
_expressions = st.recursive(
    _names,
    lambda inner: (
        st.builds('not {}'.format, inner)
        | st.builds('({})'.format, inner)
        | st.builds('{} and {}'.format, inner, inner)
        | st.builds('{} or {}'.format, inner, inner)
    ),
)


@given(_expressions, st.sets(_names))
def test_it_is_what_python_would_compute(text, present):
    wanted = eval(text, {each: each in present for each in 'abc'})
    assert parse_name_expression(text)(' '.join(present)) is wanted
