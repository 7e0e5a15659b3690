"""A report as JUnit XML: a test case for each file that was checked, and each case that ran.

Source: the schema of Jenkins' xUnit plugin, which GitLab reads too.
"""

from __future__ import annotations

import re
from itertools import groupby
from typing import TYPE_CHECKING, TypeAlias
from xml.sax.saxutils import escape, quoteattr

from composer.diagnostics import has_errors, relative_path
from composer.reports.text import render_failures, render_finding, summarize, summarize_case

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.reports.report import CaseReport, CheckedFile, Outcome, Report

# What came of a test, how many seconds it took, and its lines.
_Test: TypeAlias = 'tuple[Outcome, float, list[str]]'

# The characters that XML 1.0 does not allow, not even as an escape (https://www.w3.org/TR/xml/#charsets).
_NOT_XML = re.compile('[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]')


def render_report(report: Report) -> str:
    """Return a report as one XML document."""
    if report.cases is None:
        tests = [_test_of_file(file, is_strict=report.is_strict) for file in report.files]
        suites = [('composer check', tests)]
    else:
        groups = groupby(report.cases, key=lambda case: relative_path(case.file))
        suites = [(file, [_test_of_case(file, case) for case in cases]) for file, cases in groups]
    counts = _count([test for _, tests in suites for test in tests])
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f'<testsuites name="composer" {counts}>']
    for name, tests in suites:
        lines.append(f'  <testsuite {_attributes(name=name)} {_count(tests)} skipped="0">')
        lines += [line for *_, element in tests for line in element]
        lines.append('  </testsuite>')
    return '\n'.join([*lines, '</testsuites>']) + '\n'


def _count(tests: Sequence[_Test]) -> str:
    outcomes = [outcome for outcome, *_ in tests]
    seconds = sum(seconds for _, seconds, _ in tests)
    failed, errors = outcomes.count('failed'), outcomes.count('error')
    return f'tests="{len(tests)}" failures="{failed}" errors="{errors}" time="{seconds:.3f}"'


def _test_of_file(file: CheckedFile, *, is_strict: bool) -> _Test:
    findings, path = file.findings, relative_path(file.name)
    name = f'{path} ({file.variant})' if file.variant else path
    opening = _attributes(classname='composer', name=name, file=path, time='0')
    text = '\n\n'.join(map(render_finding, findings))
    if has_errors(findings) or (is_strict and findings):
        rules = ', '.join(dict.fromkeys(finding.rule for finding in findings))
        failure = _element('failure', text, message=summarize(findings), type=rules)
        return 'failed', 0.0, _test_case(opening, failure)
    return 'passed', 0.0, _test_case(opening, _element('system-out', text))


def _test_of_case(file: str, case: CaseReport) -> _Test:
    line = {'line': str(case.span.line)} if case.span else {}
    name, time = case.name or 'check', f'{case.real_sec:.3f}'
    opening = _attributes(classname=file, name=name, file=file, **line, time=time)
    if case.outcome == 'passed':
        return case.outcome, case.real_sec, _test_case(opening)
    shown = case.shown
    failure = _element(
        'error' if case.outcome == 'error' else 'failure',
        render_failures(case),
        message=summarize_case(case),
        type=shown.failures[0].kind if shown.failures else 'check',
    )
    output, errors = _element('system-out', shown.output), _element('system-err', shown.errors)
    return case.outcome, case.real_sec, _test_case(opening, failure, output, errors)


def _test_case(attributes: str, *parts: str) -> list[str]:
    """Return the lines of a test case, without the parts that are empty."""
    content = [f'      {part}' for part in parts if part]
    if not content:
        return [f'    <testcase {attributes}/>']
    return [f'    <testcase {attributes}>', *content, '    </testcase>']


def _element(tag: str, text: str, **attributes: str) -> str:
    """Return an element; nothing if it has no text."""
    opening = f'{tag} {_attributes(**attributes)}'.rstrip()
    return f'<{opening}>{escape(_clean(text))}</{tag}>' if text else ''


def _attributes(**values: str) -> str:
    return ' '.join(f'{name}={quoteattr(_clean(value))}' for name, value in values.items())


def _clean(text: str) -> str:
    return _NOT_XML.sub('\N{REPLACEMENT CHARACTER}', text)
