"""`composer check` of scenario files: found by name, by keys, in folders, on standard input."""

import io
import json
import sys

import pytest

from composer.cli import main as cli

SYSTEM = 'version: 1\nnodes: {rover: {}}\n'
RIGHT = """\
version: 1
system: {file: ../rover.yaml}
cases:
  nothing happens:
    then: [{log: rover, level: error, never: true}]
    until: 1
"""
WRONG = RIGHT.replace('log: rover', 'log: rovre')


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Return exit code, standard output and standard error of a check in a project."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'rover.yaml').write_text(SYSTEM)
    (tmp_path / 'tests').mkdir()
    (tmp_path / 'tests' / 'a.scenario.yaml').write_text(RIGHT)
    (tmp_path / 'tests' / 'b.yaml').write_text(WRONG)

    def run(*arguments):
        code = cli.run(['check', *arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run


FINDING = (
    "tests/b.yaml:5:18: error[unknown-node]: there is no node 'rovre' in this system\n"
    '  5 |     then: [{log: rovre, level: error, never: true}]\n'
    '    |                  ^^^^^\n'
    "  help: did you mean 'rover'?\n\n"
)


def test_scenarios_of_a_project_are_checked_with_its_systems(run):
    assert run('.') == (
        1,
        f'rover.yaml: ok, 1 node\ntests/a.scenario.yaml: ok, 1 case\n{FINDING}',
        '1 error in 1 file\n',
    )


def test_a_scenario_file_that_is_named_is_checked(run):
    assert run('tests/a.scenario.yaml') == (0, 'tests/a.scenario.yaml: ok, 1 case\n', '')
    assert run('tests/b.yaml', '--skip-other-files')[1] == FINDING
    assert run('tests/b.yaml', '--expect', 'unknown-node')[0] == 0
    assert run('tests/b.yaml', '--ignore', 'unknown-node') == (0, 'tests/b.yaml: ok, 1 case\n', '')


def test_a_scenario_file_of_an_editor_is_checked(run, monkeypatch):
    text = io.TextIOWrapper(io.BytesIO(WRONG.encode()))
    monkeypatch.setattr(sys, 'stdin', text)
    code, out, _ = run('-', '--stdin-filename', 'tests/c.scenario.yaml')
    assert code == 1
    assert out == FINDING.replace('tests/b.yaml', 'tests/c.scenario.yaml')


def test_a_report_as_json_counts_cases(run):
    _, out, _ = run('.', '--format', 'json')
    counts = {each['file']: (each['nodes'], each['cases']) for each in json.loads(out)['files']}
    assert counts == {
        'rover.yaml': (1, None),
        'tests/a.scenario.yaml': (None, 1),
        'tests/b.yaml': (None, 1),
    }


def test_the_errors_of_a_system_are_told_once(run, tmp_path):
    (tmp_path / 'rover.yaml').write_text('version: 1\nnodes: {1st: {}}\n')
    _, out, err = run('.', '-q')
    assert out.count('error[bad-name]') == 1
    assert err == ''
