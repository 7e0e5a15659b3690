"""Finds the expressions in a text, `{{ … }}`, and the names in them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from jinja2 import TemplateSyntaxError

from composer.diagnostics import Span

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.expressions.sandbox import Sandbox

OPEN, CLOSE = '{{', '}}'
# The end of an expression is searched for so far; most are near.
_USUAL, _LONGEST = 200, 10_000
# An undefined name is searched for so far; beyond, its finding shows the whole scalar.
_LONGEST_SEARCHED = 1000
# An expression without braces in its strings: to find its end takes no lexer.
_PLAIN = re.compile(r"""(?:[^'"{}\\]++|'[^'{}\\]*+'|"[^"{}\\]*+")*+\}\}""")
_MOST_LINES_SEARCHED = 100


def find_expressions(text: str, sandbox: Sandbox) -> Iterator[slice]:
    """Yield where each `{{ … }}` is, braces included.

    Raises:
        TemplateSyntaxError: One has no end.
    """
    start = text.find(OPEN)
    while start >= 0:
        begin = start + len(OPEN)
        if plain := _PLAIN.match(text, begin, begin + _USUAL):
            stop = plain.end()
            sandbox.budget.spend_on_scanning(plain.group())
        else:
            stop = begin + _measure(text[begin:], sandbox) + len(CLOSE)
        yield slice(start, stop)
        start = text.find(OPEN, stop)


def code_of(text: str, expression: slice) -> str:
    """Return what stands between the braces of an expression."""
    return text[expression.start + len(OPEN) : expression.stop - len(CLOSE)]


def locate_name(name: str, span: Span) -> Span:
    """Return where a name stands in an expression of a scalar, which may go over several lines."""
    pattern = re.compile(rf'\{{\{{(?:(?!\}}\}}).)*?(?<![\w.])({re.escape(name)})(?!\w)')
    if OPEN in span.text:
        found = pattern.search(span.text[:_LONGEST_SEARCHED])
        start = span.column + found.start(1) if found else 0
        return Span(span.source, span.line, start, len(name)) if found else span
    lines = span.source.lines[span.line - 1 : span.line - 1 + _MOST_LINES_SEARCHED]
    for number, line in enumerate(lines, start=span.line):
        if found := pattern.search(line[:_LONGEST_SEARCHED]):
            return Span(span.source, number, found.start(1) + 1, len(name))
    return span


def _measure(text: str, sandbox: Sandbox) -> int:
    """Return the length of the expression at the beginning of a text, up to its `}}`."""
    for longest in (_USUAL, _LONGEST):
        head = text[: longest + len(CLOSE)]
        sandbox.budget.spend_on_scanning(head)
        try:
            length = _find_end(head, sandbox)
        except TemplateSyntaxError:
            # The cut may be the cause.
            if len(head) == len(text):
                raise
        else:
            if length is not None:
                return length
        if len(head) == len(text):
            message = "the expression has no end: '}}' is missing"
            raise TemplateSyntaxError(message, 1)
    message = f'an expression has at most {_LONGEST} characters'
    raise TemplateSyntaxError(message, 1)


def _find_end(text: str, sandbox: Sandbox) -> int | None:
    length = -len(OPEN)
    # jinja2 makes one character of a line break of two.
    for _, kind, value in sandbox.lex(OPEN + text.replace('\r', ' ')):
        if kind == 'variable_end':
            return length + value.index(CLOSE)
        length += len(value)
    return None
