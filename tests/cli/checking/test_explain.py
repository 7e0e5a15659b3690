"""`composer explain` and `composer schema`."""

import json
from pathlib import Path

import pytest

from composer.cli import main as cli
from composer.rules import list_rule_names, load_families, load_rule


@pytest.fixture
def run(capsys):
    def run(*arguments):
        code = cli.run(list(arguments))
        out, err = capsys.readouterr()
        return code, out, err

    return run


def test_a_rule_is_explained_with_its_examples(run):
    code, out, err = run('explain', 'bad-argument')
    assert (code, err) == (0, '')
    blocks = ['Bad:', 'With driving.py:', 'What Composer reports:', 'Good:']
    assert [line for line in out.splitlines() if line in blocks] == blocks
    assert out.startswith('bad-argument: error, in the family behaviours\n\n')
    assert '# composer: ignore[bad-argument]' in out
    assert 'https://docs.python.org/3/reference/expressions.html#calls' in out
    assert "help: did you mean 'heading'?" in out


def test_every_rule_can_be_explained(run):
    for rule in sorted(list_rule_names()):
        code, out, err = run('explain', rule)
        assert (code, err) == (0, '')
        assert load_rule(rule).meaning in out
        assert load_rule(rule).why in out


def test_without_a_rule_all_are_listed_by_family(run):
    code, out, err = run('explain')
    assert (code, err) == (0, '')
    listed = [line.split()[0] for line in out.splitlines() if line.startswith('  ')]
    assert listed == [rule.name for family in load_families() for rule in family.rules]
    assert [line.split(':')[0] for line in out.splitlines() if line[:1].isalpha()] == [
        family.name for family in load_families()
    ]


def test_an_unknown_rule_is_wrong_usage(run):
    code, out, err = run('explain', 'bad-nam')
    assert (code, out) == (2, '')
    assert "there is no rule 'bad-nam'\n  help: did you mean 'bad-name'?" in err


def test_the_schema_is_printed(run):
    code, out, err = run('schema')
    assert (code, err) == (0, '')
    assert json.loads(out)['title'] == 'Composer system'


def test_the_schema_of_scenario_files_is_printed(run):
    code, out, err = run('schema', '--scenarios')
    assert (code, err) == (0, '')
    assert json.loads(out)['title'] == 'Composer scenarios'
    _, text, _ = run('schema', '--scenarios', '--path')
    path = Path(text.rstrip('\n'))
    assert path.is_absolute()
    assert path.read_text() == out


def test_one_schema_is_printed_at_a_time(run):
    code, out, err = run('schema', '--scenarios', '--matrix')
    assert (code, out) == (2, '')
    assert '--matrix and --scenarios cannot be used together' in err
