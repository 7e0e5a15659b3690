"""A test report as JUnit XML: a suite for each file, a test case for each case."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from composer.reports.junit import attribute, clean
from composer.reports.report import relative_path
from composer.scenarios.reports.text import render_failures, summarize_case

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.scenarios.reports.run_report import CaseReport, RunReport


def render_report(report: RunReport) -> str:
    """Return a report as one XML document."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines.append(f'<testsuites name="composer" {_counts(report.cases)}>')
    for file, cases in groupby(report.cases, key=lambda case: case.file):
        lines += _render_suite(relative_path(file), list(cases))
    return '\n'.join([*lines, '</testsuites>']) + '\n'


def _render_suite(file: str, cases: Sequence[CaseReport]) -> Iterator[str]:
    yield f'  <testsuite name={attribute(file)} {_counts(cases)} skipped="0">'
    for case in cases:
        yield from _render_case(file, case)
    yield '  </testsuite>'


def _counts(cases: Sequence[CaseReport]) -> str:
    failed = sum(case.outcome == 'failed' for case in cases)
    errors = sum(case.outcome == 'error' for case in cases)
    seconds = sum(case.real_sec for case in cases)
    return f'tests="{len(cases)}" failures="{failed}" errors="{errors}" time="{seconds:.3f}"'


def _render_case(file: str, case: CaseReport) -> Iterator[str]:
    line = f' line="{case.span.line}"' if case.span else ''
    name = attribute(case.name or 'check')
    opening = f'    <testcase classname={attribute(file)} name={name} file={attribute(file)}{line}'
    opening += f' time="{case.real_sec:.3f}"'
    if case.outcome == 'passed':
        yield f'{opening}/>'
        return
    yield f'{opening}>'
    tag = 'error' if case.outcome == 'error' else 'failure'
    kind = attribute(case.shown.failures[0].kind if case.shown.failures else 'check')
    text = escape(clean(render_failures(case)))
    yield f'      <{tag} message={attribute(summarize_case(case))} type={kind}>{text}</{tag}>'
    for name, output in (('system-out', case.shown.output), ('system-err', case.shown.errors)):
        if output:
            yield f'      <{name}>{escape(clean(output))}</{name}>'
    yield '    </testcase>'
