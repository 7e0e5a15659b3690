"""Plain data as YAML that Composer reads back as the same data."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

from composer.yaml_text.scalars import ScalarError, parse_plain_scalar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.yaml_text.positions import DataPath

# What needs no quotes, and looks like nothing else.
_PLAIN = re.compile(r'[A-Za-z_/~][A-Za-z0-9_/.~+-]*(:[A-Za-z0-9_/.~+-]+)*')
# Lists of scalars that fit stand on one line.
_WIDEST_LINE = 88
_REMARK_COLUMN = 48


def render_yaml(data: Any, remark: Callable[[DataPath], str] | None = None) -> str:
    """Return data as block-style YAML.

    Args:
        remark: Returns what is said of the value at a path, as a comment on its line.
    """
    return ''.join(_with_remark(line, path, remark) for line, path in _lines(data, (), 0))


def _with_remark(line: str, path: DataPath, remark: Callable[[DataPath], str] | None) -> str:
    text = remark(path) if remark else ''
    return f'{line:<{_REMARK_COLUMN}}  # {text}\n' if text else f'{line}\n'


def _lines(data: Any, path: DataPath, depth: int) -> Iterator[tuple[str, DataPath]]:
    indent = '  ' * depth
    if isinstance(data, dict):
        for key, value in data.items():
            at = (*path, key)
            inline = _inline(value, _WIDEST_LINE - len(indent) - len(key))
            if inline is not None:
                yield f'{indent}{_scalar(key)}: {inline}', at
            else:
                yield f'{indent}{_scalar(key)}:', ()
                yield from _lines(value, at, depth + 1)
    else:
        for index, value in enumerate(data):
            at = (*path, index)
            inline = _inline(value, _WIDEST_LINE - len(indent))
            if inline is not None:
                yield f'{indent}- {inline}', at
            else:
                yield f'{indent}-', ()
                yield from _lines(value, at, depth + 1)


def _inline(value: Any, width: int) -> str | None:
    """Return a value on one line, or `None` if it has to be spread over several."""
    if isinstance(value, dict):
        return None if value else '{}'
    if not isinstance(value, list):
        return _scalar(value)
    if any(isinstance(item, dict | list) for item in value):
        return None
    text = f'[{", ".join(map(_scalar, value))}]'
    return text if len(text) <= width or not value else None


def _scalar(value: Any) -> str:
    if value is None:
        return 'null'
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, float):
        return _float(value)
    return str(value) if isinstance(value, int) else _text(value)


def _float(value: float) -> str:
    if math.isnan(value):
        return '.nan'
    if math.isinf(value):
        return '.inf' if value > 0 else '-.inf'
    return repr(value)


def _text(value: str) -> str:
    try:
        is_text = bool(_PLAIN.fullmatch(value)) and parse_plain_scalar(value) == value
    except ScalarError:
        is_text = False
    if is_text:
        return value
    if '{{' in value:
        # Braces must not look like an expression, except for the one that gives them.
        value = f'{{{{ {value!r} }}}}'
    return quote_text(value)


def quote_text(value: str) -> str:
    """Return a text in double quotes, as every reader of YAML takes it."""
    # JSON's strings are those of YAML in double quotes.
    quoted = json.dumps(value, ensure_ascii=False)
    return ''.join(each if each.isprintable() else f'\\U{ord(each):08x}' for each in quoted)
