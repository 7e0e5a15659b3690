"""`composer test`: run the cases of scenario files."""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

import click

from composer import signals
from composer.application.output import show_findings, wants_colour, write_file
from composer.application.test_runs.case_runs import CaseRuns, plan_cases
from composer.application.test_runs.name_expressions import parse_name_expression
from composer.application.test_runs.run_options import DEFAULT_PATTERN
from composer.application.test_runs.scenario_selection import select_scenarios
from composer.errors import ExitCode
from composer.reports import render_report
from composer.reports.report import Report
from composer.reports.text import render_case, render_end
from composer.runtime.environment import check_ros, find_colour
from composer.runtime.tracing.timeline import Timeline
from composer.scenarios.running.case_client import CaseClient
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.application.test_runs.case_runs import CasePlan
    from composer.application.test_runs.name_expressions import Condition
    from composer.application.test_runs.run_options import RunOptions
    from composer.reports.report import CaseReport


def run_tests(words: Sequence[str], options: RunOptions) -> int:
    """Run cases and report what came of them; return the exit code.

    Args:
        words: Files, folders, patterns, and cases as `FILE::case`.

    Raises:
        UsageError: A file or a case is not there, or the expression is none.
        ComposerError: A report cannot be written.
    """
    started = monotonic()
    is_meant: Condition = lambda _: True  # noqa: E731 - the type
    if options.expression is not None:
        is_meant = parse_name_expression(options.expression)
    files = select_scenarios(words)
    check_ros()
    with (
        signals.interrupting(),
        tempfile.TemporaryDirectory(prefix='composer-traces-') as folder,
        CaseClient(find_colour()) as client,
    ):
        client.start()
        plan = plan_cases(files, is_meant)
        runs = CaseRuns(client, plan.cases, options, Path(folder))
        try:
            return _run(runs, plan, words, options, started)
        except KeyboardInterrupt:
            _report(runs.reports, plan, options, started, 'interrupted')
            raise


def _run(
    runs: CaseRuns, plan: CasePlan, words: Sequence[str], options: RunOptions, started: float
) -> int:
    _show_warnings(plan, options)
    end = ''
    for case in runs.run():
        _show_case(case, options)
        if options.ends_early and case.outcome != 'passed':
            end = 'ended at the first failure'
            break
    if options.trace:
        runs.write_trace(options.trace)
    if options.timeline:
        text = Timeline(runs.read_timelines()).render()
        write_file(options.timeline, text, 'the timeline')
    report = _report(runs.reports, plan, options, started, end)
    if not plan.cases:
        _explain_nothing(plan, words)
        return ExitCode.NOTHING_COLLECTED
    return ExitCode.FAILED if report.has_failed else ExitCode.DONE


def _show_warnings(plan: CasePlan, options: RunOptions) -> None:
    """Print the findings of files without errors; errors are shown as failures."""
    failed = {finding.sort_key for case in plan.cases for finding in case.findings}
    findings = [] if options.is_quiet else Report(plan.files).findings
    show_findings(finding for finding in findings if finding.sort_key not in failed)


def _show_case(report: CaseReport, options: RunOptions) -> None:
    if options.format == 'json' or options.is_quiet:
        return
    colour = wants_colour()
    click.echo(render_case(report, colour=colour, is_verbose=options.is_verbose), color=colour)


def _report(
    cases: Sequence[CaseReport], plan: CasePlan, options: RunOptions, started: float, end: str
) -> Report:
    """Write all reports at the end; return what they show."""
    report = Report(
        plan.files,
        cases=tuple(cases),
        deselected=plan.deselected,
        real_sec=monotonic() - started,
        end=end,
    )
    if options.format == 'json':
        click.echo(render_report(report, 'json'), nl=False)
    else:
        colour = wants_colour()
        click.echo(render_end(report, colour=colour), color=colour)
    if options.format == 'github':
        click.echo(render_report(report, 'github'), nl=False, color=False)
    if options.junit:
        write_file(options.junit, render_report(report, 'junit'), 'the report')
    return report


def _explain_nothing(plan: CasePlan, words: Sequence[str]) -> None:
    patterns = ', '.join(words) or DEFAULT_PATTERN
    what = 'no case has such a name' if plan.deselected else f'no file matches {escape(patterns)}'
    click.echo(what, err=True)
