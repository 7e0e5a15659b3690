import hashlib
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from composer.ament import BUILD_MANIFEST
from composer.interfaces.build.manifest import UntrustedFolderError, is_intact, write_manifest


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / 'robots-1'
    (folder / 'python' / 'robots').mkdir(parents=True)
    (folder / 'python' / 'robots' / 'module.py').write_text('whole')
    (folder / 'lib').mkdir()
    (folder / 'lib' / 'library.so').write_bytes(b'whole')
    (folder / 'lib').chmod(0o775)
    (folder / 'lib' / 'library.so').chmod(0o777)
    write_manifest(folder, folder, 'key')
    return folder


def overwrite(path: Path) -> None:
    path.write_bytes(b'broke')


def make_directory(path: Path) -> None:
    path.unlink()
    path.mkdir()


def replace_by_link(path: Path) -> None:
    shutil.copy2(path, path.with_suffix('.copy'))
    path.unlink()
    path.symlink_to(path.with_suffix('.copy'))


DAMAGES: dict[str, Callable[[Path], object]] = {
    'missing': shutil.rmtree,
    'empty': lambda folder: [shutil.rmtree(folder), folder.mkdir()],
    'of another build': lambda folder: overwrite_name(folder / BUILD_MANIFEST),
    'no manifest': lambda folder: (folder / BUILD_MANIFEST).unlink(),
    'manifest cut off': lambda folder: os.truncate(folder / BUILD_MANIFEST, 40),
    'strange manifest': lambda folder: (folder / BUILD_MANIFEST).write_text(
        '{"name": "robots-1", "files": {"lib/library.so": 3}}'
    ),
    'manifest is a folder': lambda folder: make_directory(folder / BUILD_MANIFEST),
    'library is missing': lambda folder: (folder / 'lib/library.so').unlink(),
    'library overwritten': lambda folder: overwrite(folder / 'lib/library.so'),
    'library is a folder': lambda folder: make_directory(folder / 'lib/library.so'),
    'library is a link': lambda folder: replace_by_link(folder / 'lib/library.so'),
    'folder is missing': lambda folder: shutil.rmtree(folder / 'python/robots'),
}


def overwrite_name(manifest: Path) -> None:
    manifest.write_text(manifest.read_text().replace('robots-1', 'robots-2'))


@pytest.mark.parametrize('damage', DAMAGES.values(), ids=DAMAGES)
def test_damage_is_found(package: Path, damage: Callable[[Path], object]) -> None:
    assert is_intact(package)
    damage(package)
    assert not is_intact(package)


def test_a_copy_is_intact_and_is_read_once(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = package / 'lib/library.so'
    before = library.stat().st_mtime_ns
    os.utime(library, (1, 1))
    assert is_intact(package)
    assert library.stat().st_mtime_ns == before
    monkeypatch.setattr(hashlib, 'file_digest', lambda *_: pytest.fail('read again'))
    assert is_intact(package)


def test_nobody_else_may_write_in_what_has_a_manifest(package: Path) -> None:
    modes = [path.stat().st_mode for path in (package, *package.rglob('*'))]
    assert not any(mode & 0o022 for mode in modes)


@pytest.mark.parametrize('name', ['.', BUILD_MANIFEST, 'lib', 'lib/library.so'])
@pytest.mark.parametrize('mode', [0o775, 0o757])
def test_what_others_may_write_is_refused(package: Path, name: str, mode: int) -> None:
    (package / name).chmod(mode)
    with pytest.raises(UntrustedFolderError) as caught:
        is_intact(package)
    path = package / name
    assert str(caught.value) == f"other users may write to the built interface package '{path}'"
    assert caught.value.help == 'remove it, or name another folder in XDG_CACHE_HOME'


@pytest.mark.parametrize('name', ['.', BUILD_MANIFEST, 'lib', 'python', 'lib/library.so'])
def test_what_belongs_to_another_user_is_refused(
    package: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if os.geteuid() == 0:
        os.chown(package / name, 12345, -1)
    else:
        name = '.'
        monkeypatch.setattr(os, 'geteuid', lambda: os.getuid() + 1)
    with pytest.raises(UntrustedFolderError) as caught:
        is_intact(package)
    path = package / name
    assert str(caught.value) == f"the built interface package '{path}' belongs to another user"
