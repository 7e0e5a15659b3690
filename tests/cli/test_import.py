"""`composer import`: what is refused, and how."""

import importlib.util

import pytest

from composer.application.importing.verification import other_values
from composer.cli.importing.import_launch import check_imported
from composer.cli.main import run
from composer.launch_files.results import Argument, Imported


@pytest.mark.parametrize(
    ('words', 'code', 'message'),
    [
        (['x.txt'], 2, "error: 'x.txt' is no launch file: it ends with none of .py, .xml"),
        (['none.launch.py'], 1, "error: there is no file 'none.launch.py'"),
        (['x.launch.py', 'side'], 2, "error: 'side' is no argument of a launch file"),
    ],
)
def test_what_cannot_be_imported_is_told(tmp_path, monkeypatch, capsys, words, code, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'x.launch.py').touch()
    assert run(['import', *words]) == code
    assert capsys.readouterr().err.startswith(message)


@pytest.mark.skipif(importlib.util.find_spec('launch') is not None, reason='launch is installed')
def test_without_launch_the_help_says_where_it_is(tmp_path, capsys):
    (tmp_path / 'x.launch.py').touch()
    assert run(['import', str(tmp_path / 'x.launch.py')]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: 'launch' cannot be imported: No module named 'launch'\n")
    assert 'help: source ROS 2' in error


@pytest.mark.parametrize(
    ('entry', 'is_refused'),
    [
        ('{command: [echo]}', False),
        ('{comand: [echo]}', True),
        ('{package: none, executable: x}', False),
    ],
)
def test_a_system_that_was_written_is_checked(tmp_path, capsys, entry, is_refused):
    path = tmp_path / 'x.yaml'
    path.write_text(f'version: 1\nprocesses: {{p: {entry}}}\n')
    assert check_imported(path, []) == is_refused
    assert ("error[unknown-key]: unknown key 'comand'" in capsys.readouterr().err) == is_refused


def test_other_values_are_those_of_choices_and_of_booleans():
    imported = Imported(
        {
            'side': Argument('side', None, '', ('left', 'right', 'top'), 'left'),
            'sim': Argument('sim', None, given='False'),
            'fixed': Argument('fixed', None, given='true', fixed=True),
            'name': Argument('name', None, given='x'),
        }
    )
    assert other_values(imported) == ['side:=right', 'side:=top', 'sim:=True']
