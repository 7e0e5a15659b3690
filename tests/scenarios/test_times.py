"""Times of scenario files are exact."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.scenarios.times import format_seconds, to_fraction, to_nanoseconds


@pytest.mark.parametrize(
    ('seconds', 'nanoseconds'),
    [(0, 0), (0.1, 100_000_000), (2.05, 2_050_000_000), (1e-9, 1), (3, 3_000_000_000),
     (0.3, 300_000_000), (1e9, 10**18), (123456.789012345, 123456789012345)],
)  # fmt: skip
def test_what_is_written_counts(seconds, nanoseconds):
    assert to_nanoseconds(seconds) == nanoseconds


@given(st.integers(0, 10**15))
def test_every_number_of_nanoseconds_can_be_written(time_ns):
    whole, rest = divmod(time_ns, 10**9)
    assert to_nanoseconds(float(f'{whole}.{rest:09d}')) == time_ns
    assert Fraction(format_seconds(time_ns).removesuffix(' s')) == Fraction(time_ns, 10**9)


def test_a_fraction_is_the_decimal_that_was_written():
    assert to_fraction(0.1) == Fraction(1, 10)
    assert to_fraction(3) == 3


def test_seconds_are_shown_without_needless_digits():
    assert [format_seconds(each) for each in (0, 2 * 10**9, 2_050_000_000, 1, -(10**8))] == [
        '0 s',
        '2 s',
        '2.05 s',
        '0.000000001 s',
        '-0.1 s',
    ]
