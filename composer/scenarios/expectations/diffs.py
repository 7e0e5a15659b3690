"""Differences between messages as lines, as in a diff: only what differs."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from composer.simulation.trace import render_value

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.scenarios.expectations.matching import Difference
    from composer.yaml_text.positions import DataPath, Key

_MOST_SHOWN = 12
_LONGEST_VALUE = 72


def render_differences(differences: Iterable[Difference]) -> str:
    """Return differences as lines: `-` is expected, `+` is what was there.

    The first dozen are shown. A value that is long is cut in its middle.
    """
    iterator = iter(differences)
    lines: list[str] = []
    last: DataPath = ()
    for each in islice(iterator, _MOST_SHOWN):
        lines += _headings(last, each.path[:-1])
        lines += _sides(each)
        last = each.path[:-1]
    more = sum(1 for _ in iterator)
    lines += [f'  … and {more} more'] if more else []
    return '\n'.join(lines)


def _headings(last: DataPath, path: DataPath) -> list[str]:
    """Return the lines for what leads to a value, without those that stand there already."""
    common = 0
    while common < min(len(last), len(path)) and last[common] == path[common]:
        common += 1
    return [f'  {"  " * depth}{_key(path[depth])}:' for depth in range(common, len(path))]


def _sides(difference: Difference) -> list[str]:
    path = difference.path
    indent = '  ' * max(len(path) - 1, 0)
    name = f'{_key(path[-1])}: ' if path else ''
    show = str if difference.is_note else show_value
    return [
        f'{sign} {indent}{name}{show(side)}'
        for sign, side in (('-', difference.expected), ('+', difference.actual))
    ]


def _key(key: Key) -> str:
    return f'[{key}]' if isinstance(key, int) else key


def show_value(value: Any) -> str:
    """Return a value as one line; one that is long is cut in its middle."""
    return shorten(render_value(value), _LONGEST_VALUE)


def shorten(text: str, longest: int) -> str:
    """Return a text with its middle left out, if it is longer than so many characters."""
    if len(text) <= longest:
        return text
    end = longest // 3
    return f'{text[: longest - end - 3]} … {text[-end:]}'
