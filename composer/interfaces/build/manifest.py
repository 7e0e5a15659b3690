"""The manifest of a built package, by which a damaged folder is found.

It lists every file with its size, its time of modification and the digest of its content. A start
compares sizes and times; only a file that was copied or touched since is read. Libraries are
mapped into memory: to load one that was cut off would end the process by a signal.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.ament import BUILD_MANIFEST
from composer.errors import ComposerError
from composer.input_limits import UnreadableFileError, read_file

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


class UntrustedFolderError(ComposerError):
    """A folder in the cache belongs to another user, or another user may write in it."""


def write_manifest(folder: Path, place: Path, environment: str) -> None:
    """List the files of a folder, and bring all of it to the disk.

    Args:
        folder: holds a package; nobody but its owner may write in it from then on.
        place: becomes the folder's path.
        environment: the key of the ROS and Python that it was built for.
    """
    files = {}
    for path in _walk(folder):
        mode = path.lstat().st_mode
        path.chmod(stat.S_IMODE(mode) & ~_WRITABLE_BY_OTHERS)
        if stat.S_ISREG(mode):
            status = path.stat()
            name = str(path.relative_to(folder))
            files[name] = [status.st_size, status.st_mtime_ns, _digest(path)]
        _sync(path)
    manifest = folder / BUILD_MANIFEST
    document = {'name': place.name, 'environment': environment, 'files': files}
    manifest.write_text(json.dumps(document), encoding='utf-8')
    manifest.chmod(0o644)
    _sync(manifest)
    _sync(folder)


def is_intact(folder: Path) -> bool:
    """Return whether a folder is there, and is as it was when its manifest was written.

    Raises:
        UntrustedFolderError: it belongs to another user, or another user may write in it.
    """
    # Strings instead of paths make it three times as fast.
    try:
        root = str(folder)
        _require_trusted(root)
        _require_trusted(f'{root}/{BUILD_MANIFEST}')
        manifest = read_manifest(folder)
        if manifest['name'] != folder.name:
            return False
        for name in _parents(manifest['files']):
            _require_trusted(f'{root}/{name}')
        return all(_is_intact(f'{root}/{name}', *file) for name, file in manifest['files'].items())
    except (OSError, ValueError, TypeError, LookupError, AttributeError):
        return False


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a folder.

    Raises:
        ValueError: there is none, or it is damaged.
    """
    try:
        document: dict[str, Any] = json.loads(read_file(folder / BUILD_MANIFEST))
    except (UnreadableFileError, RecursionError) as error:
        raise ValueError(str(error)) from error
    return document


def _parents(names: Iterable[str]) -> set[str]:
    """Return the folders that lead to files."""
    parents: set[str] = set()
    for name in names:
        parent = name.rpartition('/')[0]
        while parent and parent not in parents:
            parents.add(parent)
            parent = parent.rpartition('/')[0]
    return parents


def _is_intact(path: str, size: int, modified_ns: int, digest: str) -> bool:
    status = _require_trusted(path)
    if status.st_size != size or not stat.S_ISREG(status.st_mode):
        return False
    if status.st_mtime_ns == modified_ns:
        return True
    if _digest(Path(path)) != digest:
        return False
    with suppress(OSError):
        # Next time there is no need to read it.
        os.utime(path, ns=(status.st_atime_ns, modified_ns))
    return True


def _require_trusted(path: str) -> os.stat_result:
    """Return the status of a file or folder that only this user, or root, can change.

    Raises:
        OSError: it is not there.
        UntrustedFolderError: another user can change it.
    """
    status = os.lstat(path)
    if status.st_uid not in {os.geteuid(), 0}:
        message = f"the built interface package '{path}' belongs to another user"
    elif status.st_mode & _WRITABLE_BY_OTHERS and not stat.S_ISLNK(status.st_mode):
        message = f"other users may write to the built interface package '{path}'"
    else:
        return status
    advice = 'remove it, or name another folder in XDG_CACHE_HOME'
    raise UntrustedFolderError(message, help=advice)


def _walk(folder: Path) -> Iterator[Path]:
    """Yield all files and folders inside a folder, and then the folder."""
    for root, _, names in os.walk(folder, topdown=False):
        yield from (Path(root, name) for name in names)
        yield Path(root)


def _digest(path: Path) -> str:
    with path.open('rb') as file:
        return hashlib.file_digest(file, 'sha256').hexdigest()


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
