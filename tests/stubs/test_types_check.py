"""`composer check --types` finds what contradicts the declarations of a system, and nothing else."""

import json
import shutil
from pathlib import Path

import pytest

from composer.cli import main as cli
from composer.stubs import type_checkers

DATA = Path(__file__).resolve().parent.parent / 'data' / 'typed'

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def checked(tmp_path_factory):
    """Check the typed system once; return the exit code and the report."""
    folder = tmp_path_factory.mktemp('typed')
    shutil.copytree(DATA, folder, dirs_exist_ok=True)
    patch = pytest.MonkeyPatch()
    with patch.context() as context:
        context.chdir(folder)
        context.setenv('XDG_CACHE_HOME', str(folder / 'cache'))
        words = ['--types', 'mypy', 'system.yaml', '--format', 'json', '--output', 'report.json']
        code = cli.run(['check', *words, '--ignore', 'unknown-parameter'])
    return code, json.loads((folder / 'report.json').read_text())


def test_every_error_is_found_in_its_line_and_no_other_line(checked):
    code, report = checked
    wanted = {
        (path.name, number)
        for path in DATA.glob('*.py')
        for number, line in enumerate(path.read_text().splitlines(), start=1)
        if line.endswith('# error')
    }
    places = [place for each in report['findings'] for place in (each, *each['related'])]
    found = {(each['file'], each['line']) for each in places if each['file'].endswith('.py')}
    assert found == wanted
    assert code == 1


def test_columns_are_those_of_the_original(checked):
    lines = (DATA / 'driving.py').read_text().splitlines()
    number, line = next(each for each in enumerate(lines, start=1) if 'LONGEST' in each[1])
    (finding,) = (each for each in checked[1]['findings'] if each['line'] == number)
    assert finding['column'] == line.index('LaserScan') + 1
    assert finding['message'] == '"type[LaserScan]" has no attribute "LONGEST"'


def test_without_a_type_checker_it_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(type_checkers.importlib.util, 'find_spec', lambda name: None)
    monkeypatch.setenv('PATH', '')
    (tmp_path / 'system.yaml').write_text('version: 1\nnodes: {rover: {on_start: driving:go}}\n')
    assert cli.run(['check', '--types', 'system.yaml']) == 1
    assert (
        'neither mypy nor pyright is installed\n  help: pip install mypy'
        in capsys.readouterr().err
    )
    assert cli.run(['check', 'system.yaml', '--types', 'pyright']) == 1
    assert 'pyright is not installed\n  help: pip install pyright' in capsys.readouterr().err
