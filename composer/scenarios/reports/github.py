"""A test report as text, with an annotation of GitHub Actions for each failure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.reports.github import annotate, render_finding
from composer.scenarios.reports import text
from composer.terminal import escape_lines

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.scenarios.reports.run_report import CaseReport, RunReport


def render_report(report: RunReport) -> str:
    """Return the text, then a command for each finding and each failure, a line each."""
    return text.render_report(report) + ''.join(f'{line}\n' for line in list_commands(report))


def list_commands(report: RunReport) -> Iterator[str]:
    """Yield a command for each finding and each failure."""
    yield from map(render_finding, report.findings)
    for case in report.cases:
        yield from _render_case(case)


def _render_case(case: CaseReport) -> Iterator[str]:
    for failure in case.shown.failures:
        lines = [failure.message, *failure.difference, f'run it again: {case.command}']
        message = escape_lines('\n'.join(lines))
        yield annotate('error', case.file, failure.span or case.span, case.title, message)
