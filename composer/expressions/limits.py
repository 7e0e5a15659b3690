"""Limits on the time and memory that expressions take: sizes are measured, and work is counted.

Nothing here looks at a clock, so the result is the same on every machine. What is allowed takes
well below a second for an expression, and a few for a file.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from jinja2 import TemplateRuntimeError

if TYPE_CHECKING:
    from collections.abc import Iterable

# Of one value, in characters. No field or parameter of a file needs more.
MAX_SIZE = 1_000_000
_MAX_BITS = 10_000
_MAX_WIDTH = 1_000

# Work is counted in characters that are read or written.
_WORK_OF_EXPRESSION = 4_000_000
_WORK_OF_FILE = 40_000_000
_WORK_OF_STEP = 50
_WORK_OF_PARSING = 1000
_WORK_OF_SCANNING = 1500
_WORK_OF_LOOP = 500
_WORK_OF_VALUE = 10
# What an item of a list counts, beside its text.
_SIZE_OF_ITEM = 8

_TEXT = (str, bytes)
_COLLECTIONS = (list, tuple, set, frozenset)
_NUMBERS = re.compile(r'\d+')
_NESTED_FIELD = re.compile(r'\{[^{}]*\{')


class Budget:
    """The work that is left for a file, and for the expression that is being evaluated."""

    def __init__(self) -> None:
        self._file = _WORK_OF_FILE
        self._expression = 0

    def begin(self) -> None:
        """Begin an expression."""
        self._expression = _WORK_OF_EXPRESSION

    def spend_on_scanning(self, text: str) -> None:
        """Count a search for the end of an expression."""
        self._spend_of_file(_WORK_OF_SCANNING + len(text))

    def spend_on_parsing(self, code: str) -> None:
        """Count the parsing of an expression."""
        self._spend_of_file(_WORK_OF_PARSING * (1 + len(code) // 25))

    def spend_on_values(self, count: int) -> None:
        """Count a loop over values, or a copy of them."""
        self._spend_of_file(_WORK_OF_LOOP + _WORK_OF_VALUE * count)

    def spend(self, *values: Any) -> None:
        """Count a step that reads or writes values.

        Raises:
            TemplateRuntimeError: There is no work left, or a value is too large.
        """
        self._spend(_WORK_OF_STEP + sum(map(measure, values)))

    def collect(self, items: Iterable[Any]) -> list[Any]:
        """Return the items of an iterator as a list; each item is counted when it is made."""
        collected: list[Any] = []
        size = 0
        for item in items:
            size += measure(item) + _SIZE_OF_ITEM
            _limit(size)
            self._spend(_WORK_OF_STEP + _SIZE_OF_ITEM)
            collected.append(item)
        return collected

    def _spend(self, work: int) -> None:
        self._spend_of_file(work)
        self._expression -= work
        if self._expression < 0:
            message = 'the expression takes too much work'
            raise TemplateRuntimeError(message)

    def _spend_of_file(self, work: int) -> None:
        self._file -= work
        if self._file < 0:
            message = 'the expressions of this file take too much work'
            raise TemplateRuntimeError(message)


def measure(value: Any) -> int:
    """Return the size of a value with all that is in it, in characters.

    Raises:
        TemplateRuntimeError: It is more than a million.
    """
    size = 0
    pending = [value]
    while pending:
        each = pending.pop()
        size += _SIZE_OF_ITEM
        if isinstance(each, _TEXT):
            size += len(each)
        elif isinstance(each, int):
            if each.bit_length() > _MAX_BITS:
                message = f'a number of {each.bit_length()} bits is too large'
                raise TemplateRuntimeError(message)
        elif isinstance(each, _COLLECTIONS):
            _limit(size + _SIZE_OF_ITEM * len(each))
            pending += each
        elif isinstance(each, dict):
            _limit(size + 2 * _SIZE_OF_ITEM * len(each))
            pending += each
            pending += each.values()
        elif isinstance(each, range):
            size += _SIZE_OF_ITEM * len(each)
        _limit(size)
    return size


# Limits for operators, filters and methods: each takes the arguments of its call, and raises
# before the call would make something enormous.


def limit_power(base: Any, exponent: Any) -> None:
    """Limit the number that a power gives."""
    if isinstance(base, int) and isinstance(exponent, int):
        _limit(base.bit_length() * exponent, _MAX_BITS, "the result of '**'")


def limit_product(left: Any, right: Any) -> None:
    """Limit the repetition of a text or a list."""
    for items, times in ((left, right), (right, left)):
        if isinstance(items, (*_TEXT, list, tuple)) and isinstance(times, int):
            size = len(items) if isinstance(items, _TEXT) else measure(items)
            _limit(size * times, what="the result of '*'")


def limit_replacement(text: Any, old: Any = '', new: Any = '', *_: Any, **__: Any) -> None:
    """Limit the growth of a text in which another one is replaced."""
    text, old, new = str(text), str(old), str(new)
    _limit(len(text) + text.count(old) * len(new))


def limit_joined(items: Any = (), separator: Any = '', *_: Any, d: Any = '', **__: Any) -> None:
    """Limit a text that is joined of items."""
    if hasattr(items, '__len__'):
        _limit(measure(items) + len(items) * max(len(str(separator)), len(str(d))))


def limit_separated(separator: str, items: Any = (), *_: Any, **__: Any) -> None:
    """Limit `separator.join(items)`."""
    limit_joined(items, separator)


def limit_sum(_: Any, __: Any = None, start: Any = 0, **___: Any) -> None:
    """Allow sums of numbers only: a sum of lists copies each of them many times."""
    if not isinstance(start, int | float):
        message = 'sum takes only numbers'
        raise TemplateRuntimeError(message)


def limit_widths(_: Any, *arguments: Any, **named: Any) -> None:
    """Limit arguments that are widths or counts."""
    for value in (*arguments, *named.values()):
        if isinstance(value, int):
            _limit(abs(value), _MAX_WIDTH, f'the width or count {value}')


def limit_percent_format(template: Any, *values: Any, **named: Any) -> None:
    """Limit `template % values`."""
    _limit_formatted(str(template), [*values, named], '%')


def limit_brace_format(template: str, *values: Any, **named: Any) -> None:
    """Limit `template.format(*values, **named)`."""
    _limit_formatted(template, [values, named], '{')


def _limit_formatted(template: str, values: Any, mark: str) -> None:
    """Limit a text that is formatted; its widths stand in the template, not in the values.

    Args:
        mark: What begins a field in the template: `%` or `{`.
    """
    if '*' in template or _NESTED_FIELD.search(template):
        message = 'a width must be a number in the format itself'
        raise TemplateRuntimeError(message)
    digits = _NUMBERS.findall(template)
    _limit(max(map(len, digits), default=0), len(str(_MAX_WIDTH)), 'a width in the format')
    widest = max(map(int, digits), default=0)
    limit_widths(template, widest)
    # Escapes of `repr` make up to ten characters of one.
    _limit(len(template) + template.count(mark) * (10 * measure(values) + widest))


def _limit(size: int, limit: int = MAX_SIZE, what: str = 'the result of the expression') -> None:
    if size > limit:
        message = f'{what} is too large'
        raise TemplateRuntimeError(message)
