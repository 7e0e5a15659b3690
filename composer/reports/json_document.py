"""A report as JSON; its schema is `report.schema.json` or `test_report.schema.json`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from composer.diagnostics import describe_finding, relative_path
from composer.reports.report import count_severities
from composer.version import find_version

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.diagnostics import Diagnostic, Span
    from composer.reports.report import CaseReport, Report
    from composer.scenarios.running.case_results import CaseFailure, CaseResult

# Raised when a key is removed or changes its meaning, not when one is added.
_VERSION = 1


def render_report(report: Report) -> str:
    """Return a report as one JSON document."""
    cases = report.cases
    content = _describe_check(report) if cases is None else _describe_run(report, cases)
    document = {'version': _VERSION, 'composer': find_version(), **content}
    return json.dumps(document, indent=2) + '\n'


def _describe_check(report: Report) -> dict[str, Any]:
    errors, warnings = count_severities(report.findings)
    return {
        'files': [
            {
                'file': relative_path(file.name),
                'nodes': file.nodes,
                'cases': file.cases,
                'given': file.given,
                'combination': file.combination,
            }
            for file in report.files
        ],
        'findings': [_describe_finding(finding) for finding in report.findings],
        'errors': errors,
        'warnings': warnings,
        'failed': report.has_failed,
        'not_checked': list(report.not_checked),
    }


def _describe_run(report: Report, cases: Sequence[CaseReport]) -> dict[str, Any]:
    return {
        'cases': [_describe_case(case) for case in cases],
        'findings': [_describe_finding(finding) for finding in report.findings],
        'passed': report.count('passed'),
        'failed': report.count('failed'),
        'errors': report.count('error'),
        'deselected': report.deselected,
        'real_sec': round(report.real_sec, 3),
        'end': report.end or None,
    }


def _describe_finding(finding: Diagnostic) -> dict[str, Any]:
    return {
        **describe_finding(finding),
        'end_column': finding.span and finding.span.column + finding.span.length,
        'related': [
            {'message': related.message, **_describe_place(related.span)}
            for related in finding.related
        ],
    }


def _describe_case(case: CaseReport) -> dict[str, Any]:
    return {
        'case': case.name or None,
        **_describe_place(case.span, case.file),
        'outcome': case.outcome,
        'run_again': case.command,
        **_describe_result(case.result),
        'shuffled': [
            {
                **_describe_result(attempt.result),
                'differs': bool(attempt.difference),
                'difference': list(attempt.difference),
            }
            for attempt in case.attempts
        ],
    }


def _describe_result(result: CaseResult) -> dict[str, Any]:
    return {
        'seed': result.seed,
        'real_sec': round(result.real_sec, 3),
        'simulated_sec': result.simulated_sec,
        'failures': [_describe_failure(failure) for failure in result.failures],
        'not_repeatable': list(result.notices),
        'log': list(result.log),
        'stdout': result.output,
        'stderr': result.errors,
    }


def _describe_failure(failure: CaseFailure) -> dict[str, Any]:
    return {
        'kind': failure.kind,
        'message': failure.message,
        **_describe_place(failure.span),
        'difference': list(failure.difference),
        'around': list(failure.around),
        'stack': failure.stack,
    }


def _describe_place(span: Span | None, file: str = '') -> dict[str, Any]:
    """Return a place as plain data: the file, the line and columns."""
    file = span.source.name if span and not file else file
    return {
        'file': relative_path(file) if file else None,
        'line': span.line if span else None,
        'column': span.column if span else None,
        'end_column': span.column + span.length if span else None,
    }
