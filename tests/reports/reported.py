"""A report of `composer check` and one of `composer test`, for the tests of all formats."""

import os
from dataclasses import replace

from hypothesis import strategies as st

from composer.diagnostics import Diagnostic, Related, SourceFile, Span
from composer.reports.report import CaseReport, CheckedFile, Report
from composer.scenarios.running.case_results import CaseFailure, CaseResult

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
CHECK = Report(
    (
        CheckedFile('robots/rover.yaml', (WARNING, ERROR), 1),
        CheckedFile('lander.yaml', (PLACELESS,)),
        CheckedFile('fine.yaml', (), 2),
    ),
    ('not checked without ROS 2: types',),
)
WARNED = Report((CheckedFile(SOURCE.name, (WARNING,), 1),))
STRICT = replace(WARNED, is_strict=True)

SCENARIOS = SourceFile('tests/rover.scenario.yaml', ('cases:', '  stops:', '    - {topic: /out}'))
PASSED = CaseResult(seed=3, real_sec=0.123, simulated_sec=10.0)
FAILURE = CaseFailure(
    'expectation',
    'no message on /out',
    Span(SCENARIOS, 3, 7, 13),
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
BAD = CheckedFile(
    'tests/bad.scenario.yaml', (Diagnostic('bad-name', 'no name', 'tests/bad.scenario.yaml'),)
)


def case(result, name='stops', **more):
    """Return a case that ran."""
    return CaseReport(SCENARIOS.name, name, Span(SCENARIOS, 2, 3, 5), result, **more)


RUN = Report(
    (CheckedFile(SCENARIOS.name, cases=2), BAD),
    cases=(case(PASSED), case(FAILED, 'turns'), CaseReport(BAD.name, findings=BAD.findings)),
    deselected=2,
    real_sec=1.5,
)

# What a file, and so a finding, may hold.
texts = st.text(st.characters(exclude_categories=()), max_size=30)
# Whatever bytes a file system has.
names = st.binary(max_size=30).map(os.fsdecode)


def any_check(name, text):
    """Return a report with an error in a file of this name, which is about a text."""
    source = SourceFile(f'a{name}', (text,))
    finding = Diagnostic('bad-name', text, source.name, Span(source, 1, 1, 3), help=text)
    return Report((CheckedFile(source.name, (finding,), 0),))


def any_run(name, text):
    """Return a report of a case that failed in a file of this name, and printed a text."""
    span = Span(SourceFile(f'a{name}', (text,)), 1, 1)
    failure = CaseFailure('died', text, span, (text,), (text,), text)
    result = CaseResult((failure,), notices=(text,), log=(text,), output=text, errors=text)
    report = CaseReport(span.source.name, text or 'x', span, result)
    return Report(any_check(name, text).files, cases=(report,), end=text)
