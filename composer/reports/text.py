"""A report as text: place, message, an excerpt with a caret, and help."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING

import click

from composer.confidential import may_show_lines
from composer.reports.report import count_severities
from composer.rules import Severity
from composer.terminal import escape

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.reports.report import CheckedFile, Report

# Of a longer line, only the part around the finding is shown.
_WIDEST_LINE = 160
# Of more that crosses, the first lines are shown.
_MOST_CROSSINGS = 10

_COLOURS = {Severity.ERROR: 'red', Severity.WARNING: 'yellow'}


def render_report(report: Report) -> str:
    """Return all findings, and a line for each file without any."""
    return render_files(report, colour=False)


def render_files(report: Report, *, colour: bool, is_quiet: bool = False) -> str:
    """Return all findings; unless `is_quiet`, also a line for each file without any."""
    blocks = []
    shown: set[object] = set()
    for file in report.files:
        fresh = [finding for finding in file.findings if finding.sort_key not in shown]
        shown |= {finding.sort_key for finding in fresh}
        blocks += [f'{render_finding(finding, colour=colour)}\n\n' for finding in fresh]
        counted = _count_content(file)
        if not file.findings and counted and not is_quiet:
            name = f'{file.name} ({file.variant})' if file.variant else file.name
            blocks.append(f'{escape(name)}: ok, {counted}\n')
        if file.crossings and not is_quiet:
            blocks.append(_list_crossings(file))
    return ''.join(blocks)


def _list_crossings(file: CheckedFile) -> str:
    # Without findings there is a line with its name already.
    header = f'{escape(file.name)}:\n' if file.findings else ''
    lines = [f'crosses: {escape(each)}' for each in file.crossings[:_MOST_CROSSINGS]]
    rest = len(file.crossings) - len(lines)
    lines += [f'and {rest} more: composer graph shows all'] if rest else []
    return header + ''.join(f'  {line}\n' for line in lines)


def _count_content(file: CheckedFile) -> str:
    if file.cases is not None:
        return count(file.cases, 'case')
    if file.nodes == 0 and file.processes:
        number = file.processes
        return '1 external process' if number == 1 else f'{number} external processes'
    return '' if file.nodes is None else count(file.nodes, 'node')


def summarize(findings: list[Diagnostic]) -> str:
    """Return `2 errors and 1 warning in 1 file`."""
    errors, warnings = count_severities(findings)
    counts = [count(errors, 'error')] if errors else []
    counts += [count(warnings, 'warning')] if warnings else []
    files = len({finding.file for finding in findings})
    return f'{" and ".join(counts)} in {count(files, "file")}'


def count(number: int, noun: str) -> str:
    """Return `1 node`, `2 nodes`."""
    return f'{number} {noun}' if number == 1 else f'{number} {noun}s'


def render_finding(finding: Diagnostic, *, colour: bool = False) -> str:
    """Return a finding as text, without a newline at its end."""
    style = click.style if colour else _plain
    span = finding.span
    place = f'{finding.file}:{span.line}:{span.column}' if span else finding.file
    hue = _COLOURS[finding.severity]
    rule = style(f'{finding.severity.value}[{finding.rule}]', fg=hue, bold=True)
    lines = [f'{style(f"{escape(place)}:", bold=True)} {rule}: {escape(finding.message)}']
    if span:
        shown, carets = render_excerpt(span) or ('', '')
        lines += [shown, style(carets, fg=hue)] if shown else []
    lines += [
        f'  {escape(str(related.span))}: {escape(related.message)}' for related in finding.related
    ]
    if finding.help:
        lines.append(f'  {style("help:", fg="cyan")} {escape(finding.help)}')
    return '\n'.join(lines)


def _plain(text: str, **_style: object) -> str:
    return text


def render_excerpt(span: Span) -> tuple[str, str] | None:
    """Return the line of a span and the line that marks it; `None` if it must not be shown."""
    text, start = _cropped(span.source.line(span.line), span.column - 1)
    if not text.strip() or not may_show_lines(span.source.name):
        return None
    number = str(span.line)
    before = text[:start]
    marked = text[start : start + span.length]
    indent = ''.join(' ' * _width(character) for character in before)
    carets = '^' * max(sum(map(_width, marked)), 1)
    shown = ''.join(' ' if character == '\t' else _printable(character) for character in text)
    return f'  {number} | {shown}', f'  {" " * len(number)} | {indent}{carets}'


def _cropped(text: str, start: int) -> tuple[str, int]:
    """Return the part of a line around `start`, and where `start` is in it."""
    first = max(0, min(start - _WIDEST_LINE // 2, len(text) - _WIDEST_LINE))
    return text[first : first + _WIDEST_LINE], start - first


def _width(character: str) -> int:
    """Return how many columns a terminal gives a character."""
    if unicodedata.combining(character):
        return 0
    return 2 if unicodedata.east_asian_width(character) in 'WF' else 1


def _printable(character: str) -> str:
    return character if character.isprintable() else '\N{REPLACEMENT CHARACTER}'
