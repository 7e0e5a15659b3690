"""Plain data → YAML text that reads back as the same data, by Composer or by rcl."""

from __future__ import annotations

import json
import math
import re
import sys
from typing import TYPE_CHECKING, Any

from composer.records import record
from composer.yaml_text.scalars import (
    BOOLS_OF_YAML_1_1,
    ScalarError,
    format_scalar,
    parse_plain_scalar,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.yaml_text.positions import DataPath


@record
class Dialect:
    """What a reader of YAML needs.

    Attributes:
        quotes_values: Whether all values that are texts stand in quotes.
        has_expressions: Whether `{{` in a text begins an expression.
        reads_inexact_doubles: Whether it rounds the smallest numbers; if not, their digits are
            hexadecimal.
        widest_line: Lists of scalars that fit stand on one line.
    """

    quotes_values: bool
    has_expressions: bool
    reads_inexact_doubles: bool
    widest_line: float


# YAML 1.2 core, with expressions.
COMPOSER = Dialect(
    quotes_values=False, has_expressions=True, reads_inexact_doubles=True, widest_line=88
)
# ROS's parameter files, in which `yes` and `on` are booleans.
RCL = Dialect(
    quotes_values=True, has_expressions=False, reads_inexact_doubles=False, widest_line=math.inf
)

# What needs no quotes, and looks like nothing else.
_PLAIN = re.compile(r'[A-Za-z_/~][A-Za-z0-9_/.~+-]*(:[A-Za-z0-9_/.~+-]+)*')
_REMARK_COLUMN = 48


def render_yaml(
    data: Any, dialect: Dialect = COMPOSER, remark: Callable[[DataPath], str] | None = None
) -> str:
    """Return data as block-style YAML.

    Args:
        remark: Returns the comment for the value at a path, which goes on its line; or ''.
    """
    return ''.join(_with_remark(*line, remark) for line in _lines(data, (), 0, dialect))


def _with_remark(line: str, path: DataPath, remark: Callable[[DataPath], str] | None) -> str:
    text = remark(path) if remark else ''
    return f'{line:<{_REMARK_COLUMN}}  # {text}\n' if text else f'{line}\n'


def _lines(
    data: Any, path: DataPath, depth: int, dialect: Dialect
) -> Iterator[tuple[str, DataPath]]:
    indent = '  ' * depth
    if isinstance(data, dict):
        entries = [(key, f'{render_key(key, dialect)}:', len(key), data[key]) for key in data]
    else:
        entries = [(index, '-', 0, item) for index, item in enumerate(data)]
    for key, label, length, value in entries:
        at = (*path, key)
        width = dialect.widest_line - len(indent) - length
        inline = _render_inline(value, dialect, width)
        if inline is not None:
            yield f'{indent}{label} {inline}', at
        else:
            yield f'{indent}{label}', ()
            yield from _lines(value, at, depth + 1, dialect)


def _render_inline(value: Any, dialect: Dialect, width: float) -> str | None:
    """Return a value on one line, or `None` if it takes several."""
    if isinstance(value, dict):
        return None if value else '{}'
    if isinstance(value, list):
        if any(isinstance(item, dict | list) for item in value):
            return None
        text = f'[{", ".join(render_scalar(item, dialect) for item in value)}]'
        return text if len(text) <= width or not value else None
    return render_scalar(value, dialect)


class Expression(str):
    """A text that is written as it is, although `{{` stands in it."""

    __slots__ = ()


def render_key(key: str, dialect: Dialect) -> str:
    """Return the key of a mapping, in quotes if it needs them."""
    return key if _is_plain(key) else _quote(key, dialect)


def render_scalar(value: Any, dialect: Dialect) -> str:
    """Return a scalar as YAML."""
    if isinstance(value, str):
        # `no` would read as a bool that somebody forgot.
        is_plain = (
            not dialect.quotes_values and value not in BOOLS_OF_YAML_1_1 and _is_plain(value)
        )
        return value if is_plain else _quote(value, dialect)
    if isinstance(value, float):
        return _render_double(value, dialect)
    return 'null' if value is None else format_scalar(value)


def _render_double(value: float, dialect: Dialect) -> str:
    if math.isnan(value):
        return '.nan'
    if math.isinf(value):
        return '.inf' if value > 0 else '-.inf'
    is_subnormal = 0 < abs(value) < sys.float_info.min
    return value.hex() if is_subnormal and not dialect.reads_inexact_doubles else repr(value)


def _is_plain(text: str) -> bool:
    try:
        return bool(_PLAIN.fullmatch(text)) and parse_plain_scalar(text) == text
    except ScalarError:
        return False


def _quote(text: str, dialect: Dialect) -> str:
    if dialect.has_expressions and '{{' in text and not isinstance(text, Expression):
        # Braces must not look like an expression, except for the one that gives them.
        text = f'{{{{ {text!r} }}}}'
    # JSON's strings are those of YAML in double quotes.
    quoted = json.dumps(text, ensure_ascii=False)
    return ''.join(each if each.isprintable() else f'\\U{ord(each):08x}' for each in quoted)
