"""Which scenario files and cases a command line means."""

import pytest

from composer.application.test_runs.scenario_selection import (
    SelectedFile,
    check_case_names,
    select_scenarios,
)
from composer.errors import UsageError

FILES = (
    'tests/a.scenario.yaml',
    'tests/deep/b.scenario.yaml',
    'tests/other.yaml',
    'tests/.hidden/c.scenario.yaml',
    'elsewhere/d.scenario.yml',
)
A, B, D = (FILES[index] for index in (0, 1, 4))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


@pytest.mark.parametrize(
    ('words', 'names'),
    [
        ([], [A, B]),
        (['tests'], [A, B]),
        (['.'], [D, A, B]),
        ([B, A, B], [B, A]),
        (['elsewhere', A], [D, A]),
        (['tests/*/*.scenario.yaml'], [B]),
        (['tests/other.yaml'], ['tests/other.yaml']),
        (['nothing/**/*.scenario.yaml'], []),
    ],
)
def test_words_are_files_folders_and_patterns(words, names):
    assert [each.name for each in select_scenarios(words)] == names


@pytest.mark.parametrize(
    ('words', 'cases'),
    [
        ([f'{A}::stops'], ('stops',)),
        ([f'{A}::stops', f'{A}::starts', f'{A}::stops'], ('stops', 'starts')),
        ([f'{A}::stops', A], ()),
        ([A, f'{A}::stops'], ()),
        ([f'{A}::a case: with colons'], ('a case: with colons',)),
    ],
)
def test_a_case_stands_after_its_file(words, cases):
    assert select_scenarios(words) == [SelectedFile(A, cases)]


def test_a_file_that_is_not_there_is_an_error():
    with pytest.raises(UsageError, match='there is no file or folder'):
        select_scenarios(['tests/z.scenario.yaml'])


def test_a_case_that_is_not_there_has_a_near_one():
    with pytest.raises(UsageError, match=f"{A} has no case 'stop'") as error:
        check_case_names(SelectedFile(A, ('stop',)), ['stops', 'starts'])
    assert error.value.help == "did you mean 'stops'?"
