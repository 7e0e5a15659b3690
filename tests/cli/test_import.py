"""`composer import`: what is refused, and how."""

import importlib.util

import pytest

from composer.cli.main import run


@pytest.mark.parametrize(
    ('words', 'code', 'message'),
    [
        (['x.launch'], 2, "error: 'x.launch' is no launch file: it ends with none of .py, .xml"),
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
