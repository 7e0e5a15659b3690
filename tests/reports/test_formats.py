"""Each format is what its readers take, whatever stands in the findings."""

import json
import os
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import composer
from composer.diagnostics import Diagnostic, Related, SourceFile, Span
from composer.reports import FORMATS, render_report
from composer.reports.report import CheckedFile, Report, relative_path
from composer.reports.text import render_files

ROOT = Path(composer.__file__).parents[1]
SOURCE = SourceFile('robots/rover.yaml', ('version: 1', 'nodes:', '  rövér: {speed: 100 %}'))
ERROR = Diagnostic(
    'bad-name',
    "'rövér' cannot name a node: 100 %, really",
    SOURCE.name,
    Span(SOURCE, 3, 3, 5),
    help='write rover',
    related=(Related('here too', Span(SOURCE, 1, 1, 7)),),
)
WARNING = Diagnostic('unused-ignore', 'remove it', SOURCE.name, Span(SOURCE, 2, 7, 0))
PLACELESS = Diagnostic('unreadable-file', 'cannot read the file', 'lander.yaml')
REPORT = Report(
    (
        CheckedFile('robots/rover.yaml', (WARNING, ERROR), 1),
        CheckedFile('lander.yaml', (PLACELESS,)),
        CheckedFile('fine.yaml', (), 2),
    ),
    ('not checked without ROS 2: types',),
)
WARNED = Report((CheckedFile(SOURCE.name, (WARNING,), 1),))

# What a file, and so a finding, may hold.
texts = st.text(st.characters(exclude_categories=()), max_size=30)


# Whatever bytes a file system has.
names = st.binary(max_size=30).map(os.fsdecode)


def any_report(name, message):
    source = SourceFile(name, (message,))
    finding = Diagnostic('bad-name', message, name, Span(source, 1, 1, 3), help=message)
    return Report((CheckedFile(name, (finding,), 0),))


def test_every_format_has_its_module():
    for name in FORMATS:
        assert isinstance(render_report(REPORT, name), str)


# Paths


def test_paths_below_the_working_folder_are_relative(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert relative_path(str(tmp_path / 'a' / 'b.yaml')) == 'a/b.yaml'
    assert relative_path('./a/../b.yaml') == 'b.yaml'
    assert relative_path('../b.yaml') == (tmp_path.parent / 'b.yaml').as_posix()
    assert relative_path('<stdin>') == '<stdin>'


# Text


def test_colours_are_those_of_the_severity():
    text = render_files(REPORT, colour=True)
    assert '\x1b[31m\x1b[1merror[bad-name]\x1b[0m: ' in text
    assert '\x1b[33m\x1b[1mwarning[unused-ignore]\x1b[0m: ' in text
    assert re.sub(r'\x1b\[\d+m', '', text) == render_files(REPORT, colour=False)


def test_a_quiet_text_has_findings_alone():
    assert 'fine.yaml: ok, 2 nodes' in render_files(REPORT, colour=False)
    assert 'ok' not in render_files(REPORT, colour=False, is_quiet=True)


def test_what_several_files_share_is_shown_once():
    shared = Report((CheckedFile('a.yaml', (ERROR,), 1), CheckedFile('b.yaml', (ERROR,), 1)))
    assert render_report(shared, 'text').count('bad-name') == 1
    assert len(json.loads(render_report(shared, 'json'))['findings']) == 1


# JSON


def json_schema():
    return json.loads((ROOT / 'schemas' / 'report.schema.json').read_text())


def test_a_json_report_is_of_its_documented_form():
    schema = json_schema()
    Draft202012Validator.check_schema(schema)
    document = json.loads(render_report(REPORT, 'json'))
    Draft202012Validator(schema).validate(document)
    assert set(document) == set(schema['properties'])
    assert set(document['findings'][0]) == set(
        schema['properties']['findings']['items']['properties']
    )


def test_a_json_report_says_it_all():
    document = json.loads(render_report(REPORT, 'json'))
    assert document['files'] == [
        {'file': 'robots/rover.yaml', 'nodes': 1, 'cases': None, 'given': '', 'combination': None},
        {'file': 'lander.yaml', 'nodes': None, 'cases': None, 'given': '', 'combination': None},
        {'file': 'fine.yaml', 'nodes': 2, 'cases': None, 'given': '', 'combination': None},
    ]
    assert document['findings'][1] == {
        'rule': 'bad-name',
        'severity': 'error',
        'message': "'rövér' cannot name a node: 100 %, really",
        'help': 'write rover',
        'file': 'robots/rover.yaml',
        'line': 3,
        'column': 3,
        'end_column': 8,
        'related': [
            {
                'message': 'here too',
                'file': 'robots/rover.yaml',
                'line': 1,
                'column': 1,
                'end_column': 8,
            }
        ],
    }
    assert document['findings'][2]['line'] is None
    assert (document['errors'], document['warnings'], document['failed']) == (2, 1, True)
    assert document['not_checked'] == ['not checked without ROS 2: types']


def test_warnings_fail_a_strict_report_alone():
    strict = Report(WARNED.files, is_strict=True)
    assert not json.loads(render_report(WARNED, 'json'))['failed']
    assert json.loads(render_report(strict, 'json'))['failed']


# GitHub


def test_a_github_report_is_a_command_for_each_finding():
    assert render_report(REPORT, 'github').splitlines() == [
        '::warning file=robots/rover.yaml,line=2,endLine=2,col=7,endColumn=8,title=unused-ignore'
        '::remove it',
        '::error file=robots/rover.yaml,line=3,endLine=3,col=3,endColumn=8,title=bad-name'
        "::'rövér' cannot name a node: 100 %25, really%0Ahelp: write rover",
        '::error file=lander.yaml,title=unreadable-file::cannot read the file',
    ]


def test_what_separates_properties_is_escaped_in_them():
    text = render_report(any_report('a,b:c%.yaml', 'x'), 'github')
    assert text.startswith('::error file=a%2Cb%3Ac%25.yaml,line=1,')


@settings(deadline=None)
@given(names, texts)
def test_a_github_command_is_one_line_whatever_the_finding_says(name, message):
    report = any_report(f'a{name}', message)
    text = render_report(report, 'github')
    assert text.removesuffix('\n').isprintable()
    match = re.fullmatch(r'::error (?P<properties>[^:]*)::(?P<data>.*)\n', text, re.DOTALL)
    assert len(match['properties'].split(',')) == 6


# SARIF, of whose specification this is the part that is used: what is required, what the types
# and values are, and that no other property is there.

TEXT = {
    'type': 'object',
    'required': ['text'],
    'properties': {'text': {'type': 'string'}, 'markdown': {'type': 'string'}},
    'additionalProperties': False,
}
LEVEL = {'enum': ['none', 'note', 'warning', 'error']}
LOCATION = {
    'type': 'object',
    'required': ['artifactLocation'],
    'properties': {
        'artifactLocation': {
            'type': 'object',
            'required': ['uri'],
            'properties': {
                'uri': {'type': 'string', 'pattern': r"^[A-Za-z0-9%/:._~!$&'()*+,;=@-]+$"},
                'uriBaseId': {'const': '%SRCROOT%'},
            },
            'additionalProperties': False,
        },
        'region': {
            'type': 'object',
            'required': ['startLine'],
            'properties': {
                key: {'type': 'integer', 'minimum': 1}
                for key in ('startLine', 'startColumn', 'endLine', 'endColumn')
            },
            'additionalProperties': False,
        },
    },
    'additionalProperties': False,
}
SARIF = {
    'type': 'object',
    'required': ['version', 'runs'],
    'additionalProperties': False,
    'properties': {
        '$schema': {'type': 'string'},
        'version': {'const': '2.1.0'},
        'runs': {
            'type': 'array',
            'items': {
                'type': 'object',
                'required': ['tool', 'results'],
                'additionalProperties': False,
                'properties': {
                    'tool': {
                        'required': ['driver'],
                        'additionalProperties': False,
                        'properties': {
                            'driver': {
                                'required': ['name'],
                                'additionalProperties': False,
                                'properties': {
                                    'name': {'type': 'string'},
                                    'fullName': {'type': 'string'},
                                    'version': {'type': 'string'},
                                    'rules': {
                                        'type': 'array',
                                        'uniqueItems': True,
                                        'items': {
                                            'required': ['id'],
                                            'additionalProperties': False,
                                            'properties': {
                                                'id': {'type': 'string'},
                                                'name': {'type': 'string'},
                                                'shortDescription': TEXT,
                                                'fullDescription': TEXT,
                                                'help': TEXT,
                                                'defaultConfiguration': {
                                                    'properties': {'level': LEVEL},
                                                    'additionalProperties': False,
                                                },
                                                'properties': {
                                                    'properties': {
                                                        'tags': {
                                                            'type': 'array',
                                                            'uniqueItems': True,
                                                            'items': {'type': 'string'},
                                                        }
                                                    }
                                                },
                                            },
                                        },
                                    },
                                },
                            }
                        },
                    },
                    'columnKind': {'enum': ['utf16CodeUnits', 'unicodeCodePoints']},
                    'invocations': {
                        'type': 'array',
                        'items': {
                            'required': ['executionSuccessful'],
                            'additionalProperties': False,
                            'properties': {
                                'executionSuccessful': {'type': 'boolean'},
                                'toolExecutionNotifications': {
                                    'type': 'array',
                                    'items': {
                                        'required': ['message'],
                                        'additionalProperties': False,
                                        'properties': {'level': LEVEL, 'message': TEXT},
                                    },
                                },
                            },
                        },
                    },
                    'artifacts': {
                        'type': 'array',
                        'uniqueItems': True,
                        'items': {
                            'additionalProperties': False,
                            'properties': {
                                'location': LOCATION['properties']['artifactLocation'],
                                'sourceLanguage': {'type': 'string'},
                            },
                        },
                    },
                    'results': {
                        'type': 'array',
                        'items': {
                            'required': ['message'],
                            'additionalProperties': False,
                            'properties': {
                                'ruleId': {'type': 'string'},
                                'ruleIndex': {'type': 'integer', 'minimum': 0},
                                'level': LEVEL,
                                'message': TEXT,
                                'locations': {
                                    'type': 'array',
                                    'items': {
                                        'additionalProperties': False,
                                        'properties': {'physicalLocation': LOCATION},
                                    },
                                },
                                'relatedLocations': {
                                    'type': 'array',
                                    'uniqueItems': True,
                                    'items': {
                                        'additionalProperties': False,
                                        'properties': {
                                            'id': {'type': 'integer', 'minimum': 0},
                                            'message': TEXT,
                                            'physicalLocation': LOCATION,
                                        },
                                    },
                                },
                            },
                        },
                    },
                },
            },
        },
    },
}


@pytest.mark.parametrize('report', [REPORT, WARNED, Report(())])
def test_a_sarif_report_is_of_the_form_of_its_specification(report):
    document = json.loads(render_report(report, 'sarif'))
    Draft202012Validator(SARIF).validate(document)
    (run,) = document['runs']
    rules = run['tool']['driver']['rules']
    for result in run['results']:
        assert rules[result['ruleIndex']]['id'] == result['ruleId']


def test_a_sarif_report_says_it_all():
    (run,) = json.loads(render_report(REPORT, 'sarif'))['runs']
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


@settings(deadline=None)
@given(names, texts)
def test_a_sarif_report_is_valid_whatever_the_finding_says(name, message):
    text = render_report(any_report(f'a{name}', message), 'sarif')
    text.encode('ascii')
    Draft202012Validator(SARIF).validate(json.loads(text))


def test_a_file_elsewhere_has_a_whole_address(tmp_path, monkeypatch):
    (tmp_path / 'here').mkdir()
    monkeypatch.chdir(tmp_path / 'here')
    report = any_report(str(tmp_path / 'a b.yaml'), 'x')
    (run,) = json.loads(render_report(report, 'sarif'))['runs']
    assert run['artifacts'][0]['location'] == {'uri': f'file://{tmp_path}/a%20b.yaml'}


# JUnit


def test_a_junit_report_has_a_case_for_each_file():
    root = ET.fromstring(render_report(REPORT, 'junit'))
    assert (root.tag, root.get('tests'), root.get('failures')) == ('testsuites', '3', '2')
    (suite,) = root
    assert [case.get('name') for case in suite] == [
        'robots/rover.yaml',
        'lander.yaml',
        'fine.yaml',
    ]
    (failure,) = suite[0]
    assert failure.get('message') == '1 error and 1 warning in 1 file'
    assert failure.get('type') == 'unused-ignore, bad-name'
    assert 'robots/rover.yaml:3:3: error[bad-name]: ' in failure.text
    assert len(suite[2]) == 0


def test_warnings_are_failures_in_a_strict_junit_report_alone():
    ((case,),) = ET.fromstring(render_report(WARNED, 'junit'))
    assert [child.tag for child in case] == ['system-out']
    strict = Report(WARNED.files, is_strict=True)
    ((case,),) = ET.fromstring(render_report(strict, 'junit'))
    assert [child.tag for child in case] == ['failure']


@settings(deadline=None)
@given(names, texts)
def test_a_junit_report_is_xml_whatever_the_finding_says(name, message):
    text = render_report(any_report(f'a{name}', message), 'junit')
    root = ET.fromstring(text.encode())
    assert root.find('.//failure') is not None


def test_control_characters_have_no_place_in_xml():
    text = render_report(any_report('a\x00\x1b\ud800\ufffe.yaml', ']]>\x07<&"'), 'junit')
    root = ET.fromstring(text.encode())
    assert root.find('.//testcase').get('name') == 'a\ufffd\ufffd\ufffd\ufffd.yaml'
    assert ']]>' in root.find('.//failure').text
