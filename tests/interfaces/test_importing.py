import sys
from pathlib import Path

import pytest

from composer.interfaces.importing import ModuleTakenError, make_importable


@pytest.fixture(autouse=True)
def _own_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, 'path', list(sys.path))


def write_module(prefix: Path, package: str) -> Path:
    folder = prefix / 'python' / package
    folder.mkdir(parents=True)
    (folder / '__init__.py').write_text(f'place = {str(prefix)!r}')
    return prefix


def test_a_package_can_be_imported_from_now_on(tmp_path: Path) -> None:
    with pytest.raises(ModuleNotFoundError):
        __import__('imported_robots')
    prefix = write_module(tmp_path, 'imported_robots')
    make_importable('imported_robots', prefix)
    make_importable('imported_robots', prefix)
    assert __import__('imported_robots').place == str(prefix)
    assert sys.path.count(str(prefix / 'python')) == 1


def test_a_module_that_has_the_name_is_an_error(tmp_path: Path) -> None:
    prefix = write_module(tmp_path, 'json')
    with pytest.raises(ModuleTakenError) as caught:
        make_importable('json', prefix)
    assert str(caught.value).startswith("the interface package 'json' cannot be imported: ")
    assert str(caught.value).endswith('json/__init__.py has that name')


def test_a_package_is_not_taken_from_elsewhere(tmp_path: Path) -> None:
    old = write_module(tmp_path / 'old', 'renewed_robots')
    new = write_module(tmp_path / 'new', 'renewed_robots')
    make_importable('renewed_robots', old)
    with pytest.raises(ModuleTakenError):
        make_importable('renewed_robots', new)
