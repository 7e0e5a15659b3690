"""Each rule has a bad example that fires it alone, with what is said of it, and a good one."""

import shutil
import sys
from pathlib import Path

import pytest

from composer.checks.checker import check_system
from composer.cli.main import run
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_combinations
from composer.reports.text import render_finding
from composer.rules import RULES_FOLDER, list_rule_names, load_rule
from composer.rules.examples import load_example
from composer.runtime.behaviours.import_check import ImportCheck
from composer.scenarios.checks import check_scenarios
from composer.scenarios.scenario_files import load_scenarios
from composer.stubs.checking.kept_types import TypesCheck
from composer.stubs.checking.type_checker import find_program
from tests.rules.applied_helps import ELSEWHERE, FOR_PEOPLE, apply, read_help

WITHOUT = {
    # Only a ROS that remaps no actions shows it.
    'ignored-remap',
    # Only a ROS without content filters for Python shows it.
    'no-content-filter',
    # It is about the command line, not about a file.
    'nothing-to-check',
    # Only `composer deploy` shows it.
    'no-host',
    # It takes several files at once.
    'changes-nothing',
    # Only an installation without `rosidl_adapter` shows it.
    'unreadable-interfaces',
    # It takes a recording, which is no text.
    'unrecorded-topic',
    # It takes a module of more than 2 MB.
    'unread-module',
    # The net below the other rules of definitions; nothing is known that falls through them.
    'bad-syntax',
}
ONLY_WHEN_IMPORTED = {'broken-behaviour'}
ONLY_WITH_TYPES = {'never-equal'}

EXAMPLES = [
    pytest.param(
        name, marks=pytest.mark.ros if load_rule(name).needs == 'interfaces' else (), id=name
    )
    for name in sorted(list_rule_names() - WITHOUT)
]


@pytest.mark.parametrize('rule', sorted(list_rule_names() - WITHOUT)[::40])
def test_without_a_version_nothing_but_findings_comes(rule, tmp_path, monkeypatch, capsys):
    """The whole file counts as left out then, whatever else is in it."""
    monkeypatch.chdir(RULES_FOLDER / rule)
    for kind in ('bad', 'good'):
        text = Path(f'{kind}.yaml').read_bytes().replace(b'version: 1\n', b'', 1)
        (tmp_path / 's.yaml').write_bytes(text)
        assert run(['check', '-q', str(tmp_path / 's.yaml')]) in (0, 1)
        assert 'bug in' not in capsys.readouterr().err


def find(rule, kind):
    """Return what is found in an example, whose files are in this folder."""
    if load_rule(rule).family == 'scenarios':
        return check_scenarios(load_scenarios(Path(f'{kind}.yaml')), InterfaceCatalogue())
    further = {'import': ImportCheck()} if rule in ONLY_WHEN_IMPORTED else {}
    if rule in ONLY_WITH_TYPES:
        further['types'] = TypesCheck(find_program())
    ((_, system),) = load_combinations(Path(f'{kind}.yaml'))
    return check_system(system, InterfaceCatalogue(), further)


@pytest.mark.parametrize('rule', EXAMPLES)
def test_a_bad_example_fires_its_rule_alone_with_a_help_that_works_and_a_good_one_none(
    rule, tmp_path, monkeypatch
):
    folder = tmp_path / 'example'
    shutil.copytree(RULES_FOLDER / rule, folder)
    monkeypatch.chdir(folder)
    # Modules of the examples are no part of this process.
    monkeypatch.setattr(sys, 'dont_write_bytecode', True)
    findings = find(rule, 'bad')
    assert {(finding.rule, finding.severity) for finding in findings} == {
        (rule, load_rule(rule).severity)
    }
    said = '\n\n'.join(map(render_finding, findings)) + '\n'
    assert said.replace(f'{folder}/', '') == (folder / 'bad.txt').read_text()
    assert [render_finding(finding) for finding in find(rule, 'good')] == []
    edits = [(finding, read_help(finding)) for finding in findings if finding.help]
    assert (rule in FOR_PEOPLE) == (None in [edit for _, edit in edits])
    for finding, edit in edits:
        if edit is not None and rule not in ELSEWHERE:
            shutil.copytree(RULES_FOLDER / rule, folder, dirs_exist_ok=True)
            apply(finding, *edit)
            left = [each.message for each in find(rule, 'bad') if each.rule == rule]
            assert len(left) < len(findings), (finding.help, left)


def test_each_rule_has_an_example():
    folders = {path.parent.name for path in RULES_FOLDER.glob('*/bad.yaml')}
    assert folders == list_rule_names() - WITHOUT


def test_an_example_is_read_with_the_files_that_it_needs():
    example = load_example('bad-argument')
    assert example.bad != example.good
    assert example.report.startswith('bad.yaml:4:')
    assert list(example.others) == ['driving.py']
    assert example.others['driving.py'].startswith('def steer(')
    assert load_example('nothing-to-check') is None


def test_an_example_that_is_not_utf_8_is_read_with_escapes():
    assert r'caf\xe9' in load_example('unreadable-file').bad
