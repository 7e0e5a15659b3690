"""Findings as text: where, what, the line with a caret below it, and what to do."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span

# Of longer lines only the surroundings of the fault are shown.
_WIDEST_LINE = 160


def render_finding(finding: Diagnostic) -> str:
    """Return a finding as it is shown on a terminal; without a newline at its end."""
    place = str(finding.span) if finding.span and finding.span.length else finding.file
    if finding.span and not finding.span.length:
        place = f'{finding.file}:{finding.span.line}:{finding.span.column}'
    lines = [f'{place}: {finding.severity.value}[{finding.rule}]: {_escaped(finding.message)}']
    if finding.span:
        lines += _render_excerpt(finding.span)
    lines += [f'  {related.span}: {related.message}' for related in finding.related]
    if finding.help:
        lines.append(f'  help: {_escaped(finding.help)}')
    return '\n'.join(lines)


def _render_excerpt(span: Span) -> list[str]:
    text, start = _cropped(span.source.line(span.line), span.column - 1)
    if not text.strip():
        return []
    number = str(span.line)
    before = text[:start]
    marked = text[start : start + span.length]
    indent = ''.join(' ' * _width(character) for character in before)
    carets = '^' * max(sum(map(_width, marked)), 1)
    shown = ''.join(' ' if character == '\t' else _printable(character) for character in text)
    return [f'  {number} | {shown}', f'  {" " * len(number)} | {indent}{carets}']


def _cropped(text: str, start: int) -> tuple[str, int]:
    """Return the part of a line around `start`, and where `start` is in it."""
    first = max(0, min(start - _WIDEST_LINE // 2, len(text) - _WIDEST_LINE))
    return text[first : first + _WIDEST_LINE], start - first


def _width(character: str) -> int:
    """Return how many columns a terminal gives a character."""
    if unicodedata.combining(character):
        return 0
    return 2 if unicodedata.east_asian_width(character) in 'WF' else 1


def _escaped(text: str) -> str:
    """Return a text on one line, with what a terminal would obey written as escapes."""
    return ''.join(
        character if character.isprintable() else character.encode('unicode_escape').decode()
        for character in text
    )


def _printable(character: str) -> str:
    return character if character.isprintable() else '\N{REPLACEMENT CHARACTER}'
