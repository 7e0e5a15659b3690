"""A report as workflow commands of GitHub Actions: an annotation for each finding and failure.

Source: https://docs.github.com/en/actions/reference/workflows-and-actions/workflow-commands and,
for the escapes, `toolkit/packages/core/src/command.ts` of https://github.com/actions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.diagnostics import relative_path
from composer.terminal import escape, escape_lines

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.reports.report import CaseReport, Report
    from composer.scenarios.running.case_results import CaseFailure


def render_report(report: Report) -> str:
    """Return a command for each finding, and each failure of a case, a line each."""
    commands = [_render_finding(finding) for finding in report.findings]
    for case in report.cases or ():
        commands += [_render_failure(case, failure) for failure in case.shown.failures]
    return ''.join(f'{command}\n' for command in commands)


def _render_finding(finding: Diagnostic) -> str:
    message = escape(finding.message)
    if finding.help:
        message += f'\nhelp: {escape(finding.help)}'
    return _annotate(finding.severity.value, finding.file, finding.span, finding.rule, message)


def _render_failure(case: CaseReport, failure: CaseFailure) -> str:
    lines = [failure.message, *failure.difference, f'run it again: {case.command}']
    message = escape_lines('\n'.join(lines))
    return _annotate('error', case.file, failure.span or case.span, case.title, message)


def _annotate(kind: str, file: str, span: Span | None, title: str, message: str) -> str:
    """Return the command that annotates a place.

    Args:
        kind: `error`, `warning` or `notice`.
        message: Without characters that are not printable; may have several lines.
    """
    properties = {'file': escape(relative_path(file))}
    if span:
        end = span.column + max(span.length, 1)
        properties |= {
            'line': str(span.line),
            'endLine': str(span.line),
            'col': str(span.column),
            'endColumn': str(end),
        }
    properties['title'] = escape(title)
    listed = ','.join(f'{key}={_escape_property(value)}' for key, value in properties.items())
    return f'::{kind} {listed}::{_escape_data(message)}'


def _escape_data(text: str) -> str:
    return text.replace('%', '%25').replace('\r', '%0D').replace('\n', '%0A')


def _escape_property(text: str) -> str:
    return _escape_data(text).replace(':', '%3A').replace(',', '%2C')
