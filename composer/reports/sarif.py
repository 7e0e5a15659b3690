"""A report as SARIF 2.1.0, which code scanning and editors read.

Source: https://docs.oasis-open.org/sarif/sarif/v2.1.0/sarif-v2.1.0.html
"""

from __future__ import annotations

import json
import os
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from composer.diagnostics import relative_path
from composer.rules import load_rule
from composer.rules.examples import load_example
from composer.version import find_version

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.reports.report import Report
    from composer.rules import Rule

_SCHEMA = (
    'https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json'
)
_BASE = '%SRCROOT%'


def render_report(report: Report) -> str:
    """Return a report as one SARIF document with one run."""
    fired = sorted({finding.rule for finding in report.findings})
    places = {rule: index for index, rule in enumerate(fired)}
    driver = {
        'name': 'composer',
        'fullName': 'Composer for ROS 2',
        'version': find_version(),
        'rules': [_describe_rule(load_rule(rule)) for rule in fired],
    }
    run = {
        'tool': {'driver': driver},
        'columnKind': 'unicodeCodePoints',
        'invocations': [
            {
                'executionSuccessful': True,
                'toolExecutionNotifications': [
                    {'level': 'note', 'message': {'text': text}} for text in report.not_checked
                ],
            }
        ],
        'artifacts': [
            {'location': _artifact(name), 'sourceLanguage': 'yaml'}
            for name in dict.fromkeys(file.name for file in report.files)
        ],
        'results': [_describe(finding, places) for finding in report.findings],
    }
    return json.dumps({'$schema': _SCHEMA, 'version': '2.1.0', 'runs': [run]}, indent=2) + '\n'


def _describe_rule(rule: Rule) -> dict[str, Any]:
    example = load_example(rule.name)
    shown = (
        f'{rule.meaning} {rule.why}\n\nBad:\n\n```yaml\n{example.bad}```\n\n'
        f'Good:\n\n```yaml\n{example.good}```\n'
        if example
        else f'{rule.meaning} {rule.why}\n'
    )
    return {
        'id': rule.name,
        'name': rule.name.title().replace('-', ''),
        'shortDescription': {'text': rule.meaning},
        'fullDescription': {'text': f'{rule.meaning} {rule.why}'},
        'help': {'text': shown.replace('```yaml\n', '').replace('```', ''), 'markdown': shown},
        'defaultConfiguration': {'level': rule.severity.value},
        'properties': {'tags': [rule.family]},
    }


def _describe(finding: Diagnostic, places: dict[str, int]) -> dict[str, Any]:
    text = f'{finding.message}\nhelp: {finding.help}' if finding.help else finding.message
    result: dict[str, Any] = {
        'ruleId': finding.rule,
        'ruleIndex': places[finding.rule],
        'level': finding.severity.value,
        'message': {'text': text},
        'locations': [{'physicalLocation': _location(finding.file, finding.span)}],
    }
    if finding.related:
        result['relatedLocations'] = [
            {
                'id': number,
                'message': {'text': related.message},
                'physicalLocation': _location(related.span.source.name, related.span),
            }
            for number, related in enumerate(finding.related, start=1)
        ]
    return result


def _location(file: str, span: Span | None) -> dict[str, Any]:
    location: dict[str, Any] = {'artifactLocation': _artifact(file)}
    if span:
        location['region'] = {
            'startLine': span.line,
            'startColumn': span.column,
            'endLine': span.line,
            'endColumn': span.column + span.length,
        }
    return location


def _artifact(name: str) -> dict[str, str]:
    path = relative_path(name)
    uri = quote(os.fsencode(path))
    if PurePosixPath(path).is_absolute():
        return {'uri': f'file://{uri}'}
    return {'uri': uri, 'uriBaseId': _BASE}
