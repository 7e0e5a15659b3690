"""Errors that people write into the files of a system are found in their lines."""

import shutil
from pathlib import Path

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

DATA = Path('tests/data/planted').absolute()
ROWS = [
    line.split(' | ', 1)[:1] + line.split(' | ', 1)[1].rsplit(' | ', 1)
    for line in (DATA / 'rows.txt').read_text().splitlines()
    if not line.startswith('#')
]

pytestmark = pytest.mark.ros


def check(folder):
    layers = [folder / 'site.yaml'] if (folder / 'site.yaml').exists() else []
    return check_system(load_system(folder / 'system.yaml', layers=layers), InterfaceCatalogue())


@pytest.fixture
def files(tmp_path, monkeypatch):
    shutil.copytree(DATA, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return Path()


def test_the_files_without_errors_are_valid(files):
    assert check(files) == []
    (files / 'site.yaml').unlink()
    assert check(files) == []


@pytest.mark.sampled
@pytest.mark.parametrize(('file', 'edit', 'said'), ROWS)
def test_a_written_error_is_found_in_its_line(files, file, edit, said):
    path = files / file
    if file != 'site.yaml':
        (files / 'site.yaml').unlink()
    old, new = edit.replace('\\n', '\n').split(' >>> ')
    before, found, after = path.read_text().partition(old)
    assert found
    line = (before + new.partition('§')[0]).count('\n') + 1
    path.write_text(before + new.replace('§', '') + after)
    findings = check(files)
    there = [
        f'{each.message} {each.help}'
        for each in findings
        if (file, line)
        in {
            (place.source.name, place.line)
            for place in (each.span, *(r.span for r in each.related))
            if place
        }
    ]
    assert any(said in each for each in there), findings
