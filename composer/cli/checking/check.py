"""`composer check`: check files for errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.application.check import check as find_errors
from composer.application.output import wants_colour, write_file
from composer.errors import ExitCode, UsageError
from composer.names import count_of
from composer.records import record
from composer.reports import render_report
from composer.reports.text import render_files, summarize

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.application.check import CheckOptions
    from composer.reports.report import Report


@record
class ReportOptions:
    """How the report is written.

    Attributes:
        format: One of `composer.reports.FORMATS`.
        output: The file to write the report to; `None` for standard output.
        expected: If not empty, the check passes only if exactly these rules fire.
        is_quiet: Whether to print only findings.
    """

    format: str = 'text'
    output: Path | None = None
    expected: tuple[str, ...] = ()
    is_quiet: bool = False


def check(words: Sequence[str], options: CheckOptions, shown: ReportOptions) -> int:
    """Check systems and report what was found; return the exit code.

    Raises:
        UsageError: A rule is both ignored and expected, or see `composer.application.check`.
        ComposerError: The report cannot be written, or there is no type checker.
    """
    both = set(options.ignored) & set(shown.expected)
    if both:
        message = f"'{min(both)}' cannot be both ignored and expected"
        raise UsageError(message, help='use either --ignore or --expect')
    report = find_errors(words, options)
    _show(report, shown)
    if shown.expected:
        return _compare(report, shown)
    return ExitCode.FAILED if report.has_failed else ExitCode.DONE


def _show(report: Report, options: ReportOptions) -> None:
    """Write the report; if it goes to a file, also print the findings as text."""
    if options.output is not None:
        write_file(options.output, render_report(report, options.format), 'the report')
    if options.format == 'text' or options.output is not None:
        colour = wants_colour()
        text = render_files(report, colour=colour, is_quiet=options.is_quiet)
        click.echo(text, nl=False, color=colour)
    else:
        click.echo(render_report(report, options.format), nl=False, color=False)
    if options.is_quiet:
        return
    for line in report.not_checked:
        click.echo(line, err=True)
    summary = [summarize(report.findings)] if report.findings else []
    if report.combinations:
        summary.append(f'{count_of(report.combinations, "combination")} checked')
    if summary:
        click.echo(', '.join(summary), err=True)


def _compare(report: Report, options: ReportOptions) -> int:
    """Compare the rules that fired with those expected; return the exit code."""
    fired = {finding.rule for finding in report.findings}
    expected = set(options.expected)
    for rule in sorted(expected - fired):
        click.echo(f"expected '{rule}', which found nothing", err=True)
    for rule in sorted(fired - expected):
        click.echo(f"'{rule}' was not expected", err=True)
    if fired != expected:
        return ExitCode.FAILED
    if not options.is_quiet:
        click.echo(f'as expected: {", ".join(sorted(expected))}', err=True)
    return ExitCode.DONE
