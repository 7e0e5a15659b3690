"""A report as JSON; `schemas/report.schema.json` is its schema."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from composer.reports.report import count_severities, relative_path
from composer.version import find_version

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.reports.report import Report

# Raised when a key is removed or changes its meaning, not when one is added.
_VERSION = 1


def render_report(report: Report) -> str:
    """Return a report as one JSON document."""
    errors, warnings = count_severities(report.findings)
    document = {
        'version': _VERSION,
        'composer': find_version(),
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
        'findings': [describe_finding(finding) for finding in report.findings],
        'errors': errors,
        'warnings': warnings,
        'failed': report.has_failed,
        'not_checked': list(report.not_checked),
    }
    return json.dumps(document, indent=2) + '\n'


def describe_finding(finding: Diagnostic) -> dict[str, Any]:
    """Return a finding as plain data."""
    return {
        'rule': finding.rule,
        'severity': finding.severity.value,
        'message': finding.message,
        'help': finding.help,
        **describe_place(finding.span, finding.file),
        'related': [
            {'message': related.message, **describe_place(related.span, related.span.source.name)}
            for related in finding.related
        ],
    }


def describe_place(span: Span | None, file: str) -> dict[str, Any]:
    """Return a place as plain data: the file, the line and columns."""
    return {
        'file': relative_path(file),
        'line': span.line if span else None,
        'column': span.column if span else None,
        'end_column': span.column + span.length if span else None,
    }
