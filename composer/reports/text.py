"""A report as text: findings with their lines, and test runs as pytest users know them."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING

import click

from composer.confidential import may_show_lines
from composer.names import count_of
from composer.reports.report import count_severities
from composer.rules import Severity
from composer.terminal import escape, escape_lines

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.diagnostics import Diagnostic, Span
    from composer.reports.report import CaseReport, CheckedFile, Report
    from composer.scenarios.running.case_results import CaseFailure, CaseResult

# Of a longer line, only the part around the finding is shown.
_WIDEST_LINE = 160
# Of more that crosses, the first lines are shown.
_MOST_CROSSINGS = 10
# Of a longer log or output the end is shown.
_MOST_LINES = 30
_WIDTH = 80

_COLOURS = {Severity.ERROR: 'red', Severity.WARNING: 'yellow'}


def render_report(report: Report) -> str:
    """Return all findings, with a line for each file without any; of a test run, all cases."""
    if report.cases is None:
        return render_files(report)
    return '\n'.join([*map(render_case, report.cases), render_end(report)]) + '\n'


# Findings


def render_files(report: Report, *, colour: bool = False, is_quiet: bool = False) -> str:
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
    lines = [f'crosses: {escape(crossing)}' for crossing in file.crossings[:_MOST_CROSSINGS]]
    rest = len(file.crossings) - len(lines)
    lines += [f'and {rest} more: composer graph shows all'] if rest else []
    return header + ''.join(f'  {line}\n' for line in lines)


def _count_content(file: CheckedFile) -> str:
    if file.cases is not None:
        return count_of(file.cases, 'case')
    if file.nodes == 0 and file.processes:
        number = file.processes
        return '1 external process' if number == 1 else f'{number} external processes'
    return '' if file.nodes is None else count_of(file.nodes, 'node')


def summarize(findings: Sequence[Diagnostic]) -> str:
    """Return `2 errors and 1 warning in 1 file`."""
    errors, warnings = count_severities(findings)
    counts = [count_of(errors, 'error')] if errors else []
    counts += [count_of(warnings, 'warning')] if warnings else []
    files = len({finding.file for finding in findings})
    return f'{" and ".join(counts)} in {count_of(files, "file")}'


def render_finding(finding: Diagnostic, *, colour: bool = False) -> str:
    """Return a finding as text, without a newline at its end."""
    span = finding.span
    place = f'{finding.file}:{span.line}:{span.column}' if span else finding.file
    hue = _COLOURS[finding.severity]
    rule = click.style(f'{finding.severity.value}[{finding.rule}]', fg=hue, bold=True)
    lines = [f'{click.style(f"{escape(place)}:", bold=True)} {rule}: {escape(finding.message)}']
    lines += _render_excerpt(span, hue) if span else []
    lines += [
        f'  {escape(str(related.span))}: {escape(related.message)}' for related in finding.related
    ]
    if finding.help:
        lines.append(f'  {click.style("help:", fg="cyan")} {escape(finding.help)}')
    return _painted('\n'.join(lines), colour=colour)


def _painted(text: str, *, colour: bool) -> str:
    """Return a text with or without its colours; all else that is quoted in it is escaped."""
    return text if colour else click.unstyle(text)


def _render_excerpt(span: Span, hue: str) -> list[str]:
    """Return the line of a span and the line that marks it; nothing if it must not be shown."""
    text, start = _cropped(span.source.line(span.line), span.column - 1)
    if not text.strip() or not may_show_lines(span.source.name):
        return []
    number = str(span.line)
    before = text[:start]
    marked = text[start : start + span.length]
    indent = ''.join(' ' * _width(character) for character in before)
    carets = '^' * max(sum(map(_width, marked)), 1)
    shown = ''.join(' ' if character == '\t' else _printable(character) for character in text)
    margin = ' ' * len(number)
    return [f'  {number} | {shown}', click.style(f'  {margin} | {indent}{carets}', fg=hue)]


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


# Test runs


def render_case(case: CaseReport, *, colour: bool = False, is_verbose: bool = False) -> str:
    """Return the line of a case, and with `is_verbose` what else there is to say about it."""
    line = f'{escape(case.title)} {_render_outcome(case)}'
    if case.outcome != 'error':
        line += f' [{case.real_sec:.2f} s, {case.result.simulated_sec:g} s simulated]'
    if case.attempts:
        line += f' {_describe_orders(case)}'
    notices = case.shown.notices if is_verbose or case.outcome == 'failed' else ()
    return _painted('\n'.join([line, *map(_render_notice, notices)]), colour=colour)


def render_end(report: Report, *, colour: bool = False) -> str:
    """Return what comes after the lines of the cases, without a newline at its end."""
    failed = [case for case in report.cases or () if case.outcome != 'passed']
    lines = ['', _rule('FAILURES', '=')] if failed else []
    for case in failed:
        title = click.style(_rule(escape(case.title), '_'), fg='red', bold=True)
        lines += [title, render_failures(case, colour=colour), '']
    lines += [_rule('short test summary', '=')] if failed else []
    lines += [
        f'{_render_outcome(case)} {escape(case.title)} - {escape(summarize_case(case))}'
        for case in failed
    ]
    return _painted('\n'.join([*lines, _summarize_run(report)]), colour=colour)


def render_failures(case: CaseReport, *, colour: bool = False) -> str:
    """Return why a case failed: each failure, the log, the output, and how to run it again."""
    result = case.shown
    lines = [render_finding(finding, colour=colour) + '\n' for finding in case.findings]
    for failure in result.failures:
        lines += [*_render_failure(failure), '']
    if case.failing:
        lines += [*map(escape, case.failing.difference), '']
    lines += _render_surroundings(result)
    if case.outcome == 'failed':
        lines += map(_render_notice, result.notices)
        lines.append(f'seed {result.seed}; to run this case again: {escape(case.command)}')
    return _painted('\n'.join(lines).rstrip('\n'), colour=colour)


def summarize_case(case: CaseReport) -> str:
    """Return the first thing that is wrong, in one line."""
    messages = [finding.message for finding in case.findings]
    messages += [failure.message for failure in case.shown.failures]
    return messages[0] if messages else ''


def _summarize_run(report: Report) -> str:
    """Return the last line: `== 1 failed, 2 passed in 0.52 s, 14 s simulated ==`."""
    counts = [(report.count('failed'), 'failed'), (report.count('passed'), 'passed')]
    parts = [f'{number} {word}' for number, word in counts if number]
    if errors := report.count('error'):
        parts.append(count_of(errors, 'error'))
    if report.deselected:
        parts.append(f'{report.deselected} deselected')
    simulated = sum(case.result.simulated_sec for case in report.cases or ())
    text = ', '.join(parts) or 'no cases ran'
    text += f' in {report.real_sec:.2f} s, {simulated:g} s simulated'
    text += f'; {escape(report.end)}' if report.end else ''
    hue = 'red' if report.has_failed or report.end else 'green' if report.cases else 'yellow'
    return click.style(_rule(text, '='), fg=hue, bold=True)


def _render_outcome(case: CaseReport) -> str:
    hue = 'green' if case.outcome == 'passed' else 'red'
    return click.style(case.outcome.upper(), fg=hue, bold=True)


def _render_notice(notice: str) -> str:
    return f'  not repeatable: {escape(notice)}'


def _render_failure(failure: CaseFailure) -> Iterator[str]:
    message, span = click.style(escape_lines(failure.message), fg='red'), failure.span
    yield f'{click.style(f"{escape(str(span))}:", bold=True)} {message}' if span else message
    yield from _render_excerpt(span, 'red') if span else ()
    yield from map(_render_difference, failure.difference)
    if failure.around:
        yield '  events around it:'
        yield from (f'    {escape(line)}' for line in failure.around)
    yield from (f'  {escape(line)}' for line in failure.stack.splitlines())


def _render_difference(line: str) -> str:
    hue = {'-': 'red', '+': 'green'}.get(line.lstrip()[:1])
    return f'  {click.style(escape(line), fg=hue)}'


def _render_surroundings(result: CaseResult) -> Iterator[str]:
    sections: list[tuple[str, Sequence[str]]] = [
        ('log of the system', result.log),
        ('standard output', result.output.splitlines()),
        ('standard error', result.errors.splitlines()),
    ]
    for title, lines in sections:
        if not lines:
            continue
        yield f'--- {title} ---'
        if len(lines) > _MOST_LINES:
            yield f'({count_of(len(lines) - _MOST_LINES, "line")} before)'
        yield from map(escape_lines, lines[-_MOST_LINES:])
        yield ''


def _describe_orders(case: CaseReport) -> str:
    failed = sum(not attempt.result.has_passed for attempt in case.attempts)
    differing = sum(bool(attempt.difference) for attempt in case.attempts)
    text = f'{count_of(len(case.attempts), "other order")} tried, {differing} with other events'
    return f'({text}, {failed} failed)' if failed else f'({text})'


def _rule(text: str, line: str) -> str:
    return f' {text} '.center(_WIDTH, line)
