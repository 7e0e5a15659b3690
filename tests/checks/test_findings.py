"""A case is a file: `tests/data/invalid/<rule>.yaml` beside what is said of it, whole.

The smallest case of each rule is its example: see `tests/rules/test_examples.py`.
"""

import re
from pathlib import Path

import pytest

import composer
from composer.application.file_selection import list_systems
from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.reports.text import render_finding
from composer.rules import Severity

DATA = Path(__file__).parents[1] / 'data'
INVALID = DATA / 'invalid'
SHIPPED = list_systems(Path(composer.__file__).parents[1] / 'configs')

CASES = sorted(path.stem for path in INVALID.glob('*.yaml'))
# These look into interface packages, which come with ROS.
NEED_INTERFACES = {
    'field-type',
    'many_findings',
    'unknown-type',
}


def render(case, monkeypatch, catalogue=None):
    """Return what is said of a case, with paths as they are in its folder.

    That is every error, and the warnings of the rule that the case is about: who stands alone in
    these small files is beside their point.
    """
    monkeypatch.chdir(INVALID)
    system = load_system(Path(f'{case}.yaml'))
    findings = [
        finding
        for finding in check_system(system, catalogue or InterfaceCatalogue())
        if finding.severity is Severity.ERROR or finding.rule == case
    ]
    text = '\n\n'.join(map(render_finding, findings)) + '\n'
    return text.replace(f'{INVALID}/', '')


@pytest.mark.parametrize(
    'case',
    [
        pytest.param(case, marks=pytest.mark.ros if case in NEED_INTERFACES else ())
        for case in CASES
    ],
)
def test_everything_that_is_wrong_is_said_in_one_run(case, monkeypatch):
    expected = (INVALID / f'{case}.txt').read_text()
    assert render(case, monkeypatch) == expected


@pytest.mark.parametrize('case', sorted(set(CASES) - {'many_findings'}))
def test_a_case_shows_the_rule_that_it_is_named_after(case):
    text = (INVALID / f'{case}.txt').read_text()
    assert re.search(rf': (error|warning)\[{case}\]: ', text)


@pytest.mark.parametrize('path', [*sorted((DATA / 'valid').rglob('*.yaml')), *SHIPPED], ids=str)
def test_nothing_is_said_of_a_valid_file(path):
    findings = check_system(load_system(path), InterfaceCatalogue())
    assert [render_finding(finding) for finding in findings] == []


@pytest.mark.parametrize('case', sorted(NEED_INTERFACES - {'many_findings'}))
def test_without_ros_types_are_taken_as_they_are(case, monkeypatch):
    nothing_installed = InterfaceCatalogue(prefixes=[])
    assert render(case, monkeypatch, nothing_installed) == '\n'


def test_a_bad_namespace_of_the_defaults_is_shown_with_what_lies_in_it(tmp_path):
    file = tmp_path / 'system.yaml'
    file.write_text('version: 1\ndefaults: {namespace: /a-b}\nnodes: {n: {namespace: c}}\n')
    said = check_system(load_system(file), InterfaceCatalogue())
    findings = [each for each in said if each.rule == 'bad-name']
    assert [each.span.line for each in findings] == [3]
    assert [each.span.line for each in findings[0].related] == [2]
