"""Each format is what its readers take, whatever stands in the findings and comes of the cases."""

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given, settings
from jsonschema import Draft202012Validator

import composer
from composer.diagnostics import relative_path
from composer.reports import FORMATS, render_report
from composer.reports.report import Attempt, CheckedFile, Report
from composer.reports.text import render_files
from tests.reports.reported import (
    CHECK,
    ERROR,
    FAILED,
    PASSED,
    RUN,
    STRICT,
    WARNED,
    any_check,
    any_run,
    case,
    names,
    texts,
)

SCHEMAS = Path(composer.__file__).parents[1] / 'schemas'

# The part of SARIF's specification that is used: what is required, what the types and values are,
# and that no other property is there.


def closed(required=(), **properties):
    """Return the schema of an object that has these properties at most."""
    schema = {'type': 'object', 'properties': properties, 'additionalProperties': False}
    return {**schema, 'required': list(required)}


def array(items):
    """Return the schema of an array."""
    return {'type': 'array', 'items': items}


STRING, NUMBER = {'type': 'string'}, {'type': 'integer', 'minimum': 0}
TEXT = closed(['text'], text=STRING, markdown=STRING)
LEVEL = {'enum': ['none', 'note', 'warning', 'error']}
ARTIFACT = closed(
    ['uri'],
    uri={'type': 'string', 'pattern': r"^[A-Za-z0-9%/:._~!$&'()*+,;=@-]+$"},
    uriBaseId={'const': '%SRCROOT%'},
)
PLACES = ('startLine', 'startColumn', 'endLine', 'endColumn')
REGION = closed(['startLine'], **{key: {'type': 'integer', 'minimum': 1} for key in PLACES})
LOCATION = closed(['artifactLocation'], artifactLocation=ARTIFACT, region=REGION)
RULE = closed(
    ['id'],
    **dict.fromkeys(('id', 'name'), STRING),
    **dict.fromkeys(('shortDescription', 'fullDescription', 'help'), TEXT),
    defaultConfiguration=closed(level=LEVEL),
    properties=closed(tags={**array(STRING), 'uniqueItems': True}),
)
DRIVER = closed(
    ['name'], **dict.fromkeys(('name', 'fullName', 'version'), STRING), rules=array(RULE)
)
NOTIFICATION = closed(['message'], level=LEVEL, message=TEXT)
RESULT = closed(
    ['message'],
    ruleId=STRING,
    ruleIndex=NUMBER,
    level=LEVEL,
    message=TEXT,
    locations=array(closed(physicalLocation=LOCATION)),
    relatedLocations=array(closed(id=NUMBER, message=TEXT, physicalLocation=LOCATION)),
)
SARIF_RUN = closed(
    ['tool', 'results'],
    tool=closed(['driver'], driver=DRIVER),
    columnKind={'enum': ['utf16CodeUnits', 'unicodeCodePoints']},
    invocations=array(
        closed(
            ['executionSuccessful'],
            executionSuccessful={'type': 'boolean'},
            toolExecutionNotifications=array(NOTIFICATION),
        )
    ),
    artifacts={**array(closed(location=ARTIFACT, sourceLanguage=STRING)), 'uniqueItems': True},
    results=array(RESULT),
)
SARIF = closed(
    ['version', 'runs'], **{'$schema': STRING}, version={'const': '2.1.0'}, runs=array(SARIF_RUN)
)


def check_text(report, text):
    assert all(line.isprintable() for line in text.split('\n'))
    rules = [finding.rule for finding in report.findings] if report.cases is None else []
    assert all(f'[{rule}]: ' in text for rule in rules)


@cache
def load_schema(name):
    schema = json.loads((SCHEMAS / name).read_text())
    Draft202012Validator.check_schema(schema)
    return schema


def check_json(report, text):
    is_check = report.cases is None
    schema = load_schema('report.schema.json' if is_check else 'test_report.schema.json')
    document = json.loads(text)
    Draft202012Validator(schema).validate(document)
    assert set(document) == set(schema['properties'])
    of_findings = schema['properties']['findings']['items']
    assert all(set(finding) >= set(of_findings['required']) for finding in document['findings'])


def check_github(report, text):
    commands = text.split('\n')[:-1]
    assert len(commands) == len(report.findings) + sum(
        len(case.result.failures) for case in report.cases or ()
    )
    for command in commands:
        assert command.isprintable()
        properties = re.fullmatch('::(?:error|warning) ([^:]*)::.*', command)[1]
        assert len(properties.split(',')) in {2, 6}


def check_sarif(report, text):
    document = json.loads(text.encode('ascii'))
    Draft202012Validator(SARIF).validate(document)
    (run,) = document['runs']
    rules = run['tool']['driver']['rules']
    fired = [rules[result['ruleIndex']]['id'] for result in run['results']]
    assert fired == [result['ruleId'] for result in run['results']]
    assert fired == [finding.rule for finding in report.findings]


def check_junit(report, text):
    root = ET.fromstring(text.encode())
    tests = report.files if report.cases is None else report.cases
    assert len(root.findall('.//testcase')) == len(tests)
    for parent in (root, *root):
        for key, tag in (('tests', 'testcase'), ('failures', 'failure'), ('errors', 'error')):
            assert int(parent.get(key)) == len(parent.findall(f'.//{tag}'))


CHECKS = {
    'text': check_text,
    'json': check_json,
    'github': check_github,
    'sarif': check_sarif,
    'junit': check_junit,
}


@pytest.mark.parametrize('format_name', FORMATS)
@pytest.mark.parametrize('report', [CHECK, WARNED, STRICT, RUN, Report(), Report(cases=())])
def test_each_format_has_its_form(format_name, report):
    CHECKS[format_name](report, render_report(report, format_name))


@pytest.mark.parametrize('format_name', FORMATS)
@pytest.mark.parametrize('any_report', [any_check, any_run])
@settings(deadline=None)
@given(name=names, text=texts)
def test_each_format_has_its_form_whatever_is_in_it(format_name, any_report, name, text):
    report = any_report(name, text)
    CHECKS[format_name](report, render_report(report, format_name))


def test_paths_below_the_working_folder_are_relative(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert relative_path(str(tmp_path / 'a' / 'b.yaml')) == 'a/b.yaml'
    assert relative_path('./a/../b.yaml') == 'b.yaml'
    assert relative_path('../b.yaml') == (tmp_path.parent / 'b.yaml').as_posix()
    assert relative_path('<stdin>') == '<stdin>'


# Text


def test_colours_are_those_of_the_severity():
    text = render_files(CHECK, colour=True)
    assert '\x1b[31m\x1b[1merror[bad-name]\x1b[0m: ' in text
    assert '\x1b[33m\x1b[1mwarning[unused-ignore]\x1b[0m: ' in text
    assert re.sub(r'\x1b\[\d+m', '', text) == render_files(CHECK)


def test_a_quiet_text_has_findings_alone():
    assert 'fine.yaml: ok, 2 nodes' in render_files(CHECK)
    assert 'ok' not in render_files(CHECK, is_quiet=True)


def test_what_several_files_share_is_shown_once():
    shared = Report((CheckedFile('a.yaml', (ERROR,), 1), CheckedFile('b.yaml', (ERROR,), 1)))
    assert render_report(shared, 'text').count('bad-name') == 1
    assert len(json.loads(render_report(shared, 'json'))['findings']) == 1


def test_text_is_what_pytest_users_expect():
    assert (
        render_report(RUN, 'text')
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
    failing = Attempt(replace(FAILED, seed=5), ('the default order:', '  > 1 s a'))
    attempts = (Attempt(replace(PASSED, seed=4), ('x',)), failing)
    report = Report(cases=(case(PASSED, attempts=attempts, limit_sec=5.0),))
    text = render_report(report, 'text')
    assert '(2 other orders tried, 2 with other events, 1 failed)' in text
    assert 'the default order:\n  > 1 s a\n' in text
    command = 'tests/rover.scenario.yaml::stops --seed 5 --shuffle 1 --real-time-limit 5\n'
    assert f'to run this case again: composer test {command}' in text


def test_names_that_a_shell_would_split_are_quoted():
    assert case(PASSED, 'it stops').command == (
        "composer test 'tests/rover.scenario.yaml::it stops' --seed 3"
    )


# JSON


def test_a_json_report_says_it_all():
    document = json.loads(render_report(CHECK, 'json'))
    assert document['files'] == [
        {'file': name, 'nodes': nodes, 'cases': None, 'given': '', 'combination': None}
        for name, nodes in (('robots/rover.yaml', 1), ('lander.yaml', None), ('fine.yaml', 2))
    ]
    start = {'file': 'robots/rover.yaml', 'line': 1, 'column': 1, 'end_column': 8}
    assert document['findings'][1] == {
        'rule': 'bad-name',
        'severity': 'error',
        'message': "'rövér' cannot name a node: 100 %, really",
        'help': 'write rover',
        **start,
        'line': 3,
        'column': 3,
        'related': [{'message': 'here too', **start}],
    }
    assert document['findings'][2]['line'] is None
    assert (document['errors'], document['warnings'], document['failed']) == (2, 1, True)
    assert document['not_checked'] == ['not checked without ROS 2: types']
    failed = [json.loads(render_report(report, 'json'))['failed'] for report in (WARNED, STRICT)]
    assert failed == [False, True]


def test_a_json_report_of_a_run_says_what_came_of_each_case():
    document = json.loads(render_report(RUN, 'json'))
    assert [case['outcome'] for case in document['cases']] == ['passed', 'failed', 'error']
    (failure,) = document['cases'][1]['failures']
    place = {'file': 'tests/rover.scenario.yaml', 'line': 3, 'column': 7, 'end_column': 20}
    assert failure == {**failure, **place, 'difference': ['- data: 1', '+ data: 2']}
    assert [finding['message'] for finding in document['findings']] == ['no name']


# GitHub


def test_a_github_report_is_a_command_for_each_finding_and_failure():
    assert render_report(CHECK, 'github').splitlines() == [
        '::warning file=robots/rover.yaml,line=2,endLine=2,col=7,endColumn=8,title=unused-ignore'
        '::remove it',
        '::error file=robots/rover.yaml,line=3,endLine=3,col=3,endColumn=8,title=bad-name'
        "::'rövér' cannot name a node: 100 %25, really%0Ahelp: write rover",
        '::error file=lander.yaml,title=unreadable-file::cannot read the file',
    ]
    assert render_report(RUN, 'github').splitlines() == [
        '::error file=tests/bad.scenario.yaml,title=bad-name::no name',
        '::error file=tests/rover.scenario.yaml,line=3,endLine=3,col=7,endColumn=20,'
        'title=tests/rover.scenario.yaml%3A%3Aturns::no message on /out%0A  - data: 1%0A  + data: 2%0A'
        '  run it again: composer test tests/rover.scenario.yaml::turns --seed 3',
    ]


# SARIF


def test_a_sarif_report_says_it_all():
    (run,) = json.loads(render_report(CHECK, 'sarif'))['runs']
    warning, error, placeless = run['results']
    assert warning['level'] == 'warning'
    assert error['message']['text'].endswith('100 %, really\nhelp: write rover')
    (location,) = error['locations']
    assert location['physicalLocation'] == {
        'artifactLocation': {'uri': 'robots/rover.yaml', 'uriBaseId': '%SRCROOT%'},
        'region': {'startLine': 3, 'startColumn': 3, 'endLine': 3, 'endColumn': 8},
    }
    assert error['relatedLocations'][0]['message'] == {'text': 'here too'}
    assert 'region' not in placeless['locations'][0]['physicalLocation']
    described = next(rule for rule in run['tool']['driver']['rules'] if rule['id'] == 'bad-name')
    assert '```yaml' in described['help']['markdown']
    assert '```' not in described['help']['text']


def test_a_file_elsewhere_has_a_whole_address(tmp_path, monkeypatch):
    (tmp_path / 'here').mkdir()
    monkeypatch.chdir(tmp_path / 'here')
    report = Report((CheckedFile(str(tmp_path / 'a b.yaml')),))
    (run,) = json.loads(render_report(report, 'sarif'))['runs']
    assert run['artifacts'][0]['location'] == {'uri': f'file://{tmp_path}/a%20b.yaml'}


# JUnit


def test_a_junit_report_has_a_case_for_each_file():
    (suite,) = ET.fromstring(render_report(CHECK, 'junit'))
    files = [case.get('name') for case in suite]
    assert files == ['robots/rover.yaml', 'lander.yaml', 'fine.yaml']
    (failure,) = suite[0]
    assert failure.get('message') == '1 error and 1 warning in 1 file'
    assert failure.get('type') == 'unused-ignore, bad-name'
    assert 'robots/rover.yaml:3:3: error[bad-name]: ' in failure.text
    assert len(suite[2]) == 0


def test_a_junit_report_of_a_run_has_a_suite_for_each_file():
    root = ET.fromstring(render_report(RUN, 'junit'))
    assert root.get('time') == '0.246'
    first, second = root
    assert [case.get('name') for case in first] == ['stops', 'turns']
    failure = first[1].find('failure')
    assert (failure.get('message'), failure.get('type')) == ('no message on /out', 'expectation')
    assert '+ data: 2' in failure.text
    assert first[1].find('system-out').text == 'printed\n'
    assert second[0].find('error').get('message') == 'no name'


def test_warnings_are_failures_in_a_strict_junit_report_alone():
    for report, tag in ((WARNED, 'system-out'), (STRICT, 'failure')):
        ((case,),) = ET.fromstring(render_report(report, 'junit'))
        assert [child.tag for child in case] == [tag]
