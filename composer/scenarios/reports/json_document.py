"""A test report as JSON; `schemas/test_report.schema.json` is its schema."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from composer.reports.json_document import describe_finding, describe_place
from composer.reports.report import relative_path
from composer.version import find_version

if TYPE_CHECKING:
    from composer.scenarios.reports.run_report import CaseReport, RunReport
    from composer.scenarios.running.case_results import CaseFailure, CaseResult

# Raised when a key is removed or changes its meaning, not when one is added.
_VERSION = 1


def render_report(report: RunReport) -> str:
    """Return a report as one JSON document."""
    document = {
        'version': _VERSION,
        'composer': find_version(),
        'cases': [_describe_case(case) for case in report.cases],
        'findings': [describe_finding(finding) for finding in report.findings],
        'passed': report.count('passed'),
        'failed': report.count('failed'),
        'errors': report.count('error'),
        'deselected': report.deselected,
        'real_sec': round(report.real_sec, 3),
        'end': report.end or None,
    }
    return json.dumps(document, indent=2) + '\n'


def _describe_case(case: CaseReport) -> dict[str, Any]:
    return {
        'case': case.name or None,
        **describe_place(case.span, case.file),
        'outcome': case.outcome,
        'run_again': case.command,
        **_describe_result(case.result),
        'shuffled': [
            {
                **_describe_result(each.result),
                'differs': each.differs,
                'difference': list(each.difference),
            }
            for each in case.attempts
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
    span = failure.span
    return {
        'kind': failure.kind,
        'message': failure.message,
        'file': relative_path(span.source.name) if span else None,
        'line': span.line if span else None,
        'column': span.column if span else None,
        'difference': list(failure.difference),
        'around': list(failure.around),
        'stack': failure.stack,
    }
