"""A report as JUnit XML: a test case for each file, which fails with its findings.

Source: the schema of Jenkins' xUnit plugin, which GitLab reads too.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

from composer.diagnostics import has_errors
from composer.reports.report import relative_path
from composer.reports.text import render_finding, summarize

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.reports.report import CheckedFile, Report

# The characters that XML 1.0 does not allow, not even as an escape (https://www.w3.org/TR/xml/#charsets).
_NOT_XML = re.compile('[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]')


def render_report(report: Report) -> str:
    """Return a report as one XML document."""
    failed = sum(_has_failed(file, report) for file in report.files)
    counts = f'tests="{len(report.files)}" failures="{failed}" errors="0"'
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<testsuites name="composer" {counts}>',
        f'  <testsuite name="composer check" {counts} skipped="0" time="0">',
        *(line for file in report.files for line in _render_case(file, report)),
        '  </testsuite>',
        '</testsuites>',
    ]
    return '\n'.join(lines) + '\n'


def _has_failed(file: CheckedFile, report: Report) -> bool:
    return has_errors(file.findings) or (report.is_strict and bool(file.findings))


def _render_case(file: CheckedFile, report: Report) -> Iterator[str]:
    path = relative_path(file.name)
    name = attribute(f'{path} ({file.variant})' if file.variant else path)
    case = f'    <testcase classname="composer" name={name} file={attribute(path)} time="0"'
    if not file.findings:
        yield f'{case}/>'
        return
    text = escape(clean('\n\n'.join(map(render_finding, file.findings))))
    yield f'{case}>'
    if _has_failed(file, report):
        message = attribute(summarize(list(file.findings)))
        rules = attribute(', '.join(dict.fromkeys(f.rule for f in file.findings)))
        yield f'      <failure message={message} type={rules}>{text}</failure>'
    else:
        yield f'      <system-out>{text}</system-out>'
    yield '    </testcase>'


def attribute(text: str) -> str:
    """Return a text in quotes, as the value of an attribute."""
    return quoteattr(clean(text))


def clean(text: str) -> str:
    """Return a text without the characters that XML does not allow."""
    return _NOT_XML.sub('\N{REPLACEMENT CHARACTER}', text)
