"""Reports of test runs. Each format is a module with a `render_report`."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.scenarios.reports.run_report import RunReport

# A run imports the module of its own format only.
FORMATS: dict[str, str] = {
    'text': 'composer.scenarios.reports.text',
    'json': 'composer.scenarios.reports.json_document',
    'github': 'composer.scenarios.reports.github',
    'junit': 'composer.scenarios.reports.junit',
}


def render_report(report: RunReport, format_name: str) -> str:
    """Return a report in one of the formats, with a newline at its end if there is anything."""
    text: str = importlib.import_module(FORMATS[format_name]).render_report(report)
    return text
