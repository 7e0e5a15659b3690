"""A report as text, as pytest users know it: a line a case, failures, and a summary."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from composer.reports.text import count, render_excerpt, render_finding
from composer.terminal import escape, escape_lines

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.scenarios.reports.run_report import CaseReport, RunReport
    from composer.scenarios.running.case_results import CaseFailure, CaseResult

_COLOURS = {'passed': 'green', 'failed': 'red', 'error': 'red'}
_WIDTH = 80
# Of a longer log or output the end is shown.
_MOST_LINES = 30


def render_report(report: RunReport) -> str:
    """Return the lines of all cases, the failures and the summary."""
    lines = [render_case(case) for case in report.cases]
    return '\n'.join([*lines, *render_end(report)]) + '\n'


def render_case(case: CaseReport, *, colour: bool = False, is_verbose: bool = False) -> str:
    """Return the line of a case, and with `is_verbose` what else there is to say about it."""
    outcome = _styled(case.outcome.upper(), colour=colour, fg=_COLOURS[case.outcome], bold=True)
    line = f'{escape(case.title)} {outcome}'
    if case.outcome != 'error':
        line += f' [{case.real_sec:.2f} s, {case.result.simulated_sec:g} s simulated]'
    if case.attempts:
        line += f' {_describe_orders(case)}'
    notices = case.shown.notices if is_verbose or case.outcome == 'failed' else ()
    more = [f'  not repeatable: {escape(notice)}' for notice in notices]
    return '\n'.join([line, *more])


def render_end(report: RunReport, *, colour: bool = False) -> Iterator[str]:
    """Yield what comes after the lines of the cases."""
    failed = [case for case in report.cases if case.outcome != 'passed']
    if failed:
        yield ''
        yield _rule('FAILURES', '=')
        for case in failed:
            yield _styled(_rule(escape(case.title), '_'), colour=colour, fg='red', bold=True)
            yield render_failures(case, colour=colour)
            yield ''
        yield _rule('short test summary', '=')
        for case in failed:
            word = _styled(case.outcome.upper(), colour=colour, fg='red', bold=True)
            yield f'{word} {escape(case.title)} - {escape(summarize_case(case))}'
    yield summarize(report, colour=colour)


def render_failures(case: CaseReport, *, colour: bool = False) -> str:
    """Return why a case failed: each failure, the log, the output, and how to run it again."""
    result = case.shown
    lines = [render_finding(finding, colour=colour) + '\n' for finding in case.findings]
    for failure in result.failures:
        lines += [*_render_failure(failure, colour=colour), '']
    if case.failing:
        lines += [*map(escape, case.failing.difference), '']
    lines += _render_surroundings(result)
    if case.outcome == 'failed':
        lines += [f'  not repeatable: {escape(notice)}' for notice in result.notices]
        lines.append(f'seed {result.seed}; to run this case again: {escape(case.command)}')
    return '\n'.join(lines).rstrip('\n')


def summarize_case(case: CaseReport) -> str:
    """Return the first thing that is wrong, in one line."""
    messages = [*(each.message for each in case.findings), *_messages(case.shown)]
    return messages[0] if messages else ''


def summarize(report: RunReport, *, colour: bool = False) -> str:
    """Return the last line: `== 1 failed, 2 passed in 0.52 s, 14 s simulated ==`."""
    counts = [(report.count('failed'), 'failed'), (report.count('passed'), 'passed')]
    parts = [f'{number} {word}' for number, word in counts if number]
    if errors := report.count('error'):
        parts.append(count(errors, 'error'))
    if report.deselected:
        parts.append(f'{report.deselected} deselected')
    text = ', '.join(parts) or 'no cases ran'
    simulated = sum(case.result.simulated_sec for case in report.cases)
    text += f' in {report.real_sec:.2f} s, {simulated:g} s simulated'
    text += f'; {report.end}' if report.end else ''
    hue = 'red' if report.has_failed or report.end else 'green' if report.cases else 'yellow'
    return _styled(_rule(text, '='), colour=colour, fg=hue, bold=True)


def _messages(result: CaseResult) -> list[str]:
    return [failure.message for failure in result.failures]


def _render_failure(failure: CaseFailure, *, colour: bool) -> Iterator[str]:
    message = _styled(escape_lines(failure.message), colour=colour, fg='red')
    if failure.span:
        yield f'{_styled(f"{escape(str(failure.span))}:", colour=colour, bold=True)} {message}'
        shown, carets = render_excerpt(failure.span) or ('', '')
        yield from [shown, _styled(carets, colour=colour, fg='red')] if shown else []
    else:
        yield message
    yield from (_render_difference(line, colour=colour) for line in failure.difference)
    if failure.around:
        yield '  events around it:'
        yield from (f'    {escape(line)}' for line in failure.around)
    yield from (f'  {escape(line)}' for line in failure.stack.splitlines())


def _render_difference(line: str, *, colour: bool) -> str:
    hue = {'-': 'red', '+': 'green'}.get(line.lstrip()[:1])
    return f'  {_styled(escape(line), colour=colour, fg=hue)}'


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
            yield f'({count(len(lines) - _MOST_LINES, "line")} before)'
        yield from map(escape_lines, lines[-_MOST_LINES:])
        yield ''


def _describe_orders(case: CaseReport) -> str:
    failed = sum(not each.result.has_passed for each in case.attempts)
    differing = sum(each.differs for each in case.attempts)
    text = f'{count(len(case.attempts), "other order")} tried, {differing} with other events'
    return f'({text}, {failed} failed)' if failed else f'({text})'


def _rule(text: str, line: str) -> str:
    return f' {text} '.center(_WIDTH, line)


def _styled(text: str, *, colour: bool, **style: Any) -> str:
    return click.style(text, **style) if colour else text
