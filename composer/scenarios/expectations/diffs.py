"""Differences between messages as lines, as in a diff: only what differs."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from composer.simulation.trace import render_value

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.scenarios.expectations.matching import Difference
    from composer.yaml_text.positions import DataPath, Key

_MOST_SHOWN = 12
_MOST_ITEMS = 3
_LONGEST_VALUE = 72


def render_differences(differences: Iterable[Difference]) -> str:
    """Return differences as lines: `-` is expected, `+` is what was there.

    The first dozen are shown; of an array, the first three. A value that is long is cut in its
    middle.
    """
    lines: list[str] = []
    last: DataPath = ()
    shown = 0
    for parent, group in groupby(differences, lambda each: each.path[:-1]):
        found = list(group)
        is_array = bool(found[0].path) and isinstance(found[0].path[-1], int)
        most = min(_MOST_ITEMS if is_array else _MOST_SHOWN, _MOST_SHOWN - shown)
        if most <= 0:
            return '\n'.join([*lines, '  …'])
        lines += _headings(last, parent)
        lines += [line for each in found[:most] for line in _sides(each)]
        more = len(found) - most
        lines += [f'  {"  " * len(parent)}… and {more} more'] if more > 0 else []
        shown += min(len(found), most)
        last = parent
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
