"""Reports of `composer check` and `composer test`: a module with a `render_report` each format."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.reports.report import Report

# A run imports the module of its own format only.
FORMATS: dict[str, str] = {
    'text': 'composer.reports.text',
    'json': 'composer.reports.json_document',
    'github': 'composer.reports.github',
    'sarif': 'composer.reports.sarif',
    'junit': 'composer.reports.junit',
}


def render_report(report: Report, format_name: str) -> str:
    """Return a report in one of the formats, with a newline at its end if there is anything."""
    text: str = importlib.import_module(FORMATS[format_name]).render_report(report)
    return text
