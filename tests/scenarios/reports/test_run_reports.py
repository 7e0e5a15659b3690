"""Reports of test runs: what pytest users expect, and what the readers of each format take."""

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import composer
from composer.diagnostics import Diagnostic, SourceFile, Span
from composer.scenarios.reports import FORMATS, render_report
from composer.scenarios.reports.run_report import Attempt, CaseReport, RunReport
from composer.scenarios.reports.text import render_case
from composer.scenarios.running.case_results import CaseFailure, CaseResult

ROOT = Path(composer.__file__).parents[1]
SOURCE = SourceFile('tests/rover.scenario.yaml', ('cases:', '  stops:', '    - {topic: /out}'))
PASSED = CaseResult(seed=3, real_sec=0.123, simulated_sec=10.0)
FAILURE = CaseFailure(
    'expectation',
    'no message on /out',
    Span(SOURCE, 3, 7, 13),
    ('- data: 1', '+ data: 2'),
    ('> 1.000000000 message /a /out {data: 2}',),
)
FAILED = replace(
    PASSED,
    failures=(FAILURE,),
    notices=('behaviours/a.py:3: a thread of its own',),
    log=('2 s [error] [/a]: too fast',),
    output='printed\n',
)
FINDING = Diagnostic('bad-name', 'no name', 'tests/bad.scenario.yaml')


def case(result, name='stops', **more):
    return CaseReport(SOURCE.name, name, Span(SOURCE, 2, 3, 5), result, **more)


BROKEN = CaseReport('tests/bad.scenario.yaml', '', None, CaseResult(), findings=(FINDING,))
REPORT = RunReport(
    (case(PASSED), case(FAILED, 'turns'), BROKEN), (FINDING,), deselected=2, real_sec=1.5
)


def test_text_is_what_pytest_users_expect():
    assert (
        render_report(REPORT, 'text')
        == """\
tests/rover.scenario.yaml::stops PASSED [0.12 s, 10 s simulated]
tests/rover.scenario.yaml::turns FAILED [0.12 s, 10 s simulated]
  not repeatable: behaviours/a.py:3: a thread of its own
tests/bad.scenario.yaml ERROR

=================================== FAILURES ===================================
_______________________ tests/rover.scenario.yaml::turns _______________________
tests/rover.scenario.yaml:3:7: no message on /out
  3 |     - {topic: /out}
    |       ^^^^^^^^^^^^^
  - data: 1
  + data: 2
  events around it:
    > 1.000000000 message /a /out {data: 2}

--- log of the system ---
2 s [error] [/a]: too fast

--- standard output ---
printed

  not repeatable: behaviours/a.py:3: a thread of its own
seed 3; to run this case again: composer test tests/rover.scenario.yaml::turns --seed 3

___________________________ tests/bad.scenario.yaml ____________________________
tests/bad.scenario.yaml: error[bad-name]: no name

============================== short test summary ==============================
FAILED tests/rover.scenario.yaml::turns - no message on /out
ERROR tests/bad.scenario.yaml - no name
===== 1 failed, 1 passed, 1 error, 2 deselected in 1.50 s, 20 s simulated ======
"""
    )


def test_a_shuffled_failure_shows_both_orders_and_how_to_have_it_again():
    failing = Attempt(replace(FAILED, seed=5), ('the default order:', '  > 1 s a'), differs=True)
    attempts = (Attempt(replace(PASSED, seed=4), ('x',), differs=True), failing)
    report = RunReport((case(PASSED, attempts=attempts, limit_sec=5.0),))
    text = render_report(report, 'text')
    assert '(2 other orders tried, 2 with other events, 1 failed)' in text
    assert 'the default order:\n  > 1 s a\n' in text
    command = 'tests/rover.scenario.yaml::stops --seed 5 --shuffle 1 --real-time-limit 5\n'
    assert f'to run this case again: composer test {command}' in text


def test_other_orders_that_pass_are_counted():
    attempts = (Attempt(PASSED), Attempt(PASSED, ('x',), differs=True))
    line = render_case(case(PASSED, attempts=attempts))
    assert line.endswith(
        'PASSED [0.37 s, 10 s simulated] (2 other orders tried, 1 with other events)'
    )


def test_names_that_a_shell_would_split_are_quoted():
    assert case(PASSED, 'it stops').command == (
        "composer test 'tests/rover.scenario.yaml::it stops' --seed 3"
    )


def test_github_annotates_the_line_of_the_expectation():
    assert render_report(REPORT, 'github').splitlines()[-2:] == [
        '::error file=tests/bad.scenario.yaml,title=bad-name::no name',
        '::error file=tests/rover.scenario.yaml,line=3,endLine=3,col=7,endColumn=20,'
        'title=tests/rover.scenario.yaml%3A%3Aturns::no message on /out%0A  - data: 1%0A  + data: 2%0A'
        '  run it again: composer test tests/rover.scenario.yaml::turns --seed 3',
    ]


def test_junit_has_a_suite_for_each_file():
    root = ET.fromstring(render_report(REPORT, 'junit'))
    assert root.attrib == {
        'name': 'composer', 'tests': '3', 'failures': '1', 'errors': '1', 'time': '0.246'
    }  # fmt: skip
    first, second = root
    assert [each.get('name') for each in first] == ['stops', 'turns']
    failure = first[1].find('failure')
    assert (failure.get('message'), failure.get('type')) == ('no message on /out', 'expectation')
    assert '+ data: 2' in failure.text
    assert first[1].find('system-out').text == 'printed\n'
    assert second[0].find('error').get('message') == 'no name'


def check_json(report):
    schema = json.loads((ROOT / 'schemas' / 'test_report.schema.json').read_text())
    document = json.loads(render_report(report, 'json'))
    Draft202012Validator.check_schema(schema)
    Draft202012Validator(schema).validate(document)
    return document


def test_json_is_what_its_schema_says():
    document = check_json(REPORT)
    assert [each['outcome'] for each in document['cases']] == ['passed', 'failed', 'error']
    (failure,) = document['cases'][1]['failures']
    assert (failure['line'], failure['difference']) == (3, ['- data: 1', '+ data: 2'])


@given(st.text(st.characters(exclude_categories=()), max_size=30))
def test_whatever_a_case_prints_each_format_can_show(text):
    failure = CaseFailure('died', text, Span(SOURCE, 1, 1), (text,), (text,), text)
    result = CaseResult((failure,), notices=(text,), log=(text,), output=text, errors=text)
    report = RunReport((case(result, text or 'x'),), end=text)
    check_json(report)
    ET.fromstring(render_report(report, 'junit').encode('utf-8', 'surrogatepass'))
    assert '\x1b' not in render_report(report, 'text') + render_report(report, 'github')


@pytest.mark.parametrize('name', FORMATS)
def test_an_empty_run_has_a_report(name):
    assert render_report(RunReport(()), name).endswith('\n')
