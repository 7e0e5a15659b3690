"""How much an expression may do and make: sizes are measured, and work is counted.

Nothing here looks at a clock, so the verdict is the same on every machine. What is allowed takes
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
_WORK_OF_FILE = 50_000_000
_WORK_OF_STEP = 50
_WORK_OF_PARSING = 500
_WORK_OF_READING = 1500
# What an item of a list weighs, beside its text.
_SIZE_OF_ITEM = 8

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

    def spend_on_reading(self, text: str) -> None:
        """Count a search for the end of an expression."""
        self._spend_of_file(_WORK_OF_READING + len(text))

    def spend_on_parsing(self, code: str) -> None:
        """Count the parsing of an expression."""
        self._spend_of_file(_WORK_OF_PARSING * (1 + len(code) // 25))

    def spend(self, work: int = 0) -> None:
        """Count a step that reads or writes so many characters.

        Raises:
            TemplateRuntimeError: Too much has been done.
        """
        self._spend_of_file(work + _WORK_OF_STEP)
        self._expression -= work + _WORK_OF_STEP
        if self._expression < 0:
            message = 'the expression takes too much work'
            raise TemplateRuntimeError(message)

    def weigh(self, *values: Any) -> None:
        """Count a step that reads or writes values."""
        self.spend(sum(map(measure, values)))

    def listed(self, items: Iterable[Any]) -> list[Any]:
        """Return the items of an iterator, whose making is counted item by item."""
        found: list[Any] = []
        size = 0
        for item in items:
            size += measure(item) + _SIZE_OF_ITEM
            _limit(size)
            self.spend(_SIZE_OF_ITEM)
            found.append(item)
        return found

    def _spend_of_file(self, work: int) -> None:
        self._file -= work
        if self._file < 0:
            message = 'the expressions of this file take too much work'
            raise TemplateRuntimeError(message)


def measure(value: Any) -> int:
    """Return the size of a value with all that is in it.

    Raises:
        TemplateRuntimeError: It is more than a megabyte.
    """
    size = 0
    pending = [value]
    while pending:
        each = pending.pop()
        size += _SIZE_OF_ITEM
        if isinstance(each, str | bytes):
            size += len(each)
        elif isinstance(each, list | tuple | set | frozenset | range):
            _limit(size + _SIZE_OF_ITEM * len(each))
            if isinstance(each, range):
                size += _SIZE_OF_ITEM * len(each)
            else:
                pending.extend(each)
        elif isinstance(each, dict):
            _limit(size + 2 * _SIZE_OF_ITEM * len(each))
            pending.extend(each)
            pending.extend(each.values())
        elif isinstance(each, int) and each.bit_length() > _MAX_BITS:
            message = f'a number of {each.bit_length()} bits is too large'
            raise TemplateRuntimeError(message)
        _limit(size)
    return size


def limit_power(base: Any, exponent: Any) -> None:
    """Raise if a power would be enormous."""
    if isinstance(base, int) and isinstance(exponent, int):
        _limit(base.bit_length() * exponent, _MAX_BITS, "the result of '**'")


def limit_product(left: Any, right: Any) -> None:
    """Raise if the repetition of a text or a list would be enormous."""
    for items, times in ((left, right), (right, left)):
        if isinstance(items, str | bytes | list | tuple) and isinstance(times, int):
            size = len(items) if isinstance(items, str | bytes) else measure(items)
            _limit(size * times, what="the result of '*'")


def limit_replacement(text: Any, old: Any = '', new: Any = '', *_: Any, **__: Any) -> None:
    """Raise if a text would grow enormous."""
    text, old, new = str(text), str(old), str(new)
    _limit(len(text) + text.count(old) * len(new))


def limit_joined(items: Any = (), separator: Any = '', *_: Any, d: Any = '', **__: Any) -> None:
    """Raise if a text that is joined of items would be enormous."""
    if hasattr(items, '__len__'):
        _limit(measure(items) + len(items) * max(len(str(separator)), len(str(d))))


def limit_sum(_: Any, __: Any = None, start: Any = 0, **___: Any) -> None:
    """Raise if what is summed is no numbers: a sum of lists copies each of them many times."""
    if not isinstance(start, int | float):
        message = 'sum is for numbers'
        raise TemplateRuntimeError(message)


def limit_widths(*values: Any) -> None:
    """Raise if one of the arguments would be a width or a count beyond a thousand."""
    for value in values:
        if isinstance(value, int):
            _limit(abs(value), _MAX_WIDTH, f'{value}, as a width or a count,')


def limit_percent_format(template: Any, *values: Any, **named: Any) -> None:
    """Raise if what `%` makes of a text could be enormous."""
    limit_formatted(str(template), [*values, named], '%')


def limit_formatted(template: str, values: Any, mark: str) -> None:
    """Raise if a text that is formatted could be enormous, or its widths come from values.

    Args:
        mark: What begins a field in the template: `%` or `{`.
    """
    if '*' in template or _NESTED_FIELD.search(template):
        message = 'a width is written as a number in the format itself'
        raise TemplateRuntimeError(message)
    digits = _NUMBERS.findall(template)
    _limit(max(map(len, digits), default=0), len(str(_MAX_WIDTH)), 'a width in the format')
    widest = max(map(int, digits), default=0)
    limit_widths(widest)
    # Escapes of `repr` make up to ten characters of one.
    _limit(len(template) + template.count(mark) * (10 * measure(values) + widest))


def _limit(size: int, limit: int = MAX_SIZE, what: str = 'what the expression makes') -> None:
    if size > limit:
        message = f'{what} is too large'
        raise TemplateRuntimeError(message)
