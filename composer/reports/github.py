"""A report as workflow commands of GitHub Actions: each finding is an annotation of its line.

Source: https://docs.github.com/en/actions/reference/workflows-and-actions/workflow-commands and,
for the escapes, `toolkit/packages/core/src/command.ts` of https://github.com/actions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.reports.report import relative_path
from composer.terminal import escape

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic
    from composer.reports.report import Report


def render_report(report: Report) -> str:
    """Return a command for each finding, a line each."""
    return ''.join(f'{_command(finding)}\n' for finding in report.findings)


def _command(finding: Diagnostic) -> str:
    properties = {'file': escape(relative_path(finding.file))}
    if finding.span:
        end = finding.span.column + max(finding.span.length, 1)
        properties |= {
            'line': str(finding.span.line),
            'endLine': str(finding.span.line),
            'col': str(finding.span.column),
            'endColumn': str(end),
        }
    properties['title'] = finding.rule
    listed = ','.join(f'{key}={_escape_property(value)}' for key, value in properties.items())
    message = escape(finding.message)
    if finding.help:
        message += f'\nhelp: {escape(finding.help)}'
    return f'::{finding.severity.value} {listed}::{_escape_data(message)}'


def _escape_data(text: str) -> str:
    return text.replace('%', '%25').replace('\r', '%0D').replace('\n', '%0A')


def _escape_property(text: str) -> str:
    return _escape_data(text).replace(':', '%3A').replace(',', '%2C')
