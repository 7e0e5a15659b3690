"""Where expressions stand in their file."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.diagnostics import Span

if TYPE_CHECKING:
    from composer.python_source.modules import ModuleSource


def span_of(module: ModuleSource, node: ast.AST, name: str = '') -> Span:
    """Return the characters of an expression on its last line; of a text, those of its content.

    Args:
        name: What to mark in it: the text, or the last name of a chain of attributes.
    """
    first_line: int = getattr(node, 'lineno', 1)
    line: int = getattr(node, 'end_lineno', first_line)
    source = module.source
    start: int = getattr(node, 'col_offset', 0) if first_line == line else 0
    end: int = getattr(node, 'end_col_offset', None) or start + 1
    if isinstance(node, ast.Attribute):
        name = node.attr
    elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        line, name = first_line, node.name
        start, end = 0, len(source.line(line).encode())
    text = source.line(line)
    first, last = _characters(text, start), _characters(text, end)
    found = text[first:last].rfind(name) if name else -1
    if found >= 0:
        first += found
        last = first + len(name)
    return Span(source, line, first + 1, max(last - first, 1))


def _characters(line: str, offset: int) -> int:
    """Return the number of characters in the first `offset` bytes of a line."""
    return offset if line.isascii() else len(line.encode()[:offset].decode(errors='ignore'))
