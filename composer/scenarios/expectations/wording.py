"""The words for times, windows and counts in failures."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer import names
from composer.names import with_article
from composer.scenarios.times import format_seconds

if TYPE_CHECKING:
    from composer.scenarios.specs import WindowSpec


def in_window(window: WindowSpec) -> str:
    """Return ` from 2 s to 2.1 s`; nothing for the whole case."""
    if window.end_ns is None:
        return ''
    return f' from {format_seconds(window.start_ns)} to {format_seconds(window.end_ns)}'


def count_of(number: int, noun: str) -> str:
    """Return `no message`, `1 message`, `2 messages`."""
    return names.count_of(number, noun) if number else f'no {noun}'


def expected_count(least: int, most: int | None, noun: str) -> str:
    """Return `no message`, `a message`, `2 messages`, `1 to 3 messages`."""
    if most is None:
        return with_article(noun) if least == 1 else f'at least {count_of(least, noun)}'
    return count_of(least, noun) if least == most else f'{least} to {most} {noun}s'


def at_time(time_ns: int) -> str:
    """Return ` at 2.05 s`."""
    return f' at {format_seconds(time_ns)}'
