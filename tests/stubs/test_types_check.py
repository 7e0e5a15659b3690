"""`composer check --types` finds what contradicts the declarations of a system, and nothing else."""

import shutil
from pathlib import Path

import pytest

from composer.checks.checker import create_context
from composer.cli import main as cli
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.stubs import type_checkers
from composer.stubs.types_check import TypesCheck

DATA = Path(__file__).resolve().parent.parent / 'data' / 'typed'

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def found(tmp_path_factory):
    """Check the types of a system once, as if no other check had found anything."""
    folder = tmp_path_factory.mktemp('typed')
    shutil.copytree(DATA, folder, dirs_exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv('XDG_CACHE_HOME', str(folder / 'cache'))
        context = create_context(load_system(Path('system.yaml')), InterfaceCatalogue())
        return list(TypesCheck(type_checkers.find_type_checker('mypy'))(context, []))


def test_every_error_is_found_in_its_line_and_no_other_line(found):
    wanted = {
        (path.name, number)
        for path in DATA.glob('*.py')
        for number, line in enumerate(path.read_text().splitlines(), start=1)
        if line.endswith('# error')
    }
    assert {(each.span.source.name, each.span.line) for each in found} == wanted


def test_columns_are_those_of_the_original(found):
    lines = (DATA / 'driving.py').read_text().splitlines()
    number, line = next(each for each in enumerate(lines, start=1) if 'LONGEST' in each[1])
    (finding,) = (each for each in found if each.span.line == number)
    assert finding.span.column == line.index('LaserScan') + 1
    assert finding.message == '"type[LaserScan]" has no attribute "LONGEST"'


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
