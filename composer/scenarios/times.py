"""Times of scenario files: seconds as written → nanoseconds, exactly."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

NANOSECONDS = 1_000_000_000


def to_nanoseconds(seconds: float) -> int:
    """Return seconds, as YAML has them, in nanoseconds; `0.1` is 100 000 000.

    The decimal that was written counts, not the double nearest to it. What is finer than a
    nanosecond is rounded.
    """
    return int((Decimal(repr(seconds)) * NANOSECONDS).to_integral_value())


def to_fraction(number: float) -> Fraction:
    """Return a number as it was written: `0.1` is one tenth."""
    return Fraction(repr(number))


def format_seconds(time_ns: int) -> str:
    """Return nanoseconds as seconds without needless digits: `2 s`, `2.05 s`."""
    sign = '-' if time_ns < 0 else ''
    whole, rest = divmod(abs(time_ns), NANOSECONDS)
    digits = f'{rest:09d}'.rstrip('0')
    return f'{sign}{whole}.{digits} s' if digits else f'{sign}{whole} s'
