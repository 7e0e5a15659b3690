"""What a host has of a system: releases, and the environments of Python that they share.

FOLDER/wheels/            wheels of what is required, for all systems
FOLDER/venvs/DIGEST/      an environment for each set of these
FOLDER/composer/DIGEST/   Composer itself
FOLDER/locks/SYSTEM       held by the deployment that is under way
FOLDER/systems/SYSTEM/
    releases/NUMBER/      what was brought; manifest.json says what that is
    current               a link to the release that runs
    pending               while a deployment is under way: a link to the one before it
    incoming/             what has arrived for the next one
    start                 what the unit runs
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import sys
import time
import zipfile
from pathlib import Path
from typing import Any, TextIO

from composer.hosts.agent.files_there import (
    digest_file,
    read_json,
    read_link,
    remove_empty,
    remove_tree,
    write_file,
    write_json,
    write_link,
)
from composer.hosts.agent.host_errors import HostError, run

# The one that runs, and the one before it.
_KEPT = 2
_NEW_SEC = 3600.0
_MANIFEST = 'manifest.json'
_TWO_NAMES = (
    'use one name for a host, or give each another folder; if it has got a new name, remove '
    "it by the old one first: 'composer deploy … --remove' with the files that have that name"
)
# What of the folder of a system is not of others.
_BROUGHT = ('releases', 'current', 'pending', 'incoming', 'start', 'before.json')


class Store:
    """The files of a system on this host.

    Args:
        folder: Where Composer keeps its files, as the inventory says it.
        system: The name of the system, as a folder's.
    """

    def __init__(self, folder: str, system: str) -> None:
        self.folder = Path(folder).expanduser()
        if not self.folder.is_absolute():
            self.folder = Path.home() / self.folder
        self.system = system
        self.root = self.folder / 'systems' / system
        self.current = self.root / 'current'
        self.live = self.root / 'live'
        self.pending = self.root / 'pending'
        self.incoming = self.root / 'incoming'
        self._parts = bytearray()
        self._lock: TextIO | None = None

    def lock(self, owner: str) -> None:
        """Keep other deployments of the system away until this process ends.

        Raises:
            HostError: There is one.
        """
        path = self.folder / 'locks' / self.system
        path.parent.mkdir(parents=True, exist_ok=True)
        stream = path.open('a+')
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            stream.seek(0)
            holder = stream.read() or 'another'
            stream.close()
            if holder.startswith(f'{owner}, '):
                message = f"'{self.system}' is being deployed here by another name of this host"
                raise HostError(message, _TWO_NAMES) from error
            message = f"'{self.system}' is being deployed by {holder}"
            raise HostError(message, 'wait until that has ended') from error
        stream.truncate(0)
        stream.write(f'{owner}, since {time.strftime("%H:%M:%S")}')
        stream.flush()
        self._lock = stream

    @property
    def is_locked(self) -> bool:
        """Whether this process keeps other deployments away."""
        return self._lock is not None

    def manifest(self, release: str | None = None) -> dict[str, Any] | None:
        """Return what a release is, by default the one that runs; `None` if there is none."""
        release = release or read_link(self.current)
        found = None if release is None else read_json(self.root / release / _MANIFEST)
        return found if isinstance(found, dict) else None

    def list_edited(self) -> dict[str, str]:
        """Return the digests of the files that were written here and then edited, by path."""
        manifest = self.manifest()
        if manifest is None:
            return {}
        given = _list_digests(manifest)
        now = {name: digest_file(self.live / name) for name in given}
        return {
            name: found
            for name, found in now.items()
            if found is not None and found != given[name]
        }

    def list_missing(self) -> list[str]:
        """Return the files that were written here and are not there any more."""
        given = _list_digests(self.manifest())
        return [name for name in given if not (self.live / name).exists()]

    def keep_others(self) -> list[Path]:
        """Move what others have written beside what was brought to `edited`; return where to."""
        own = _list_digests(self.manifest())
        kept = []
        for path in sorted(self.root.rglob('*')):
            top, *inner = path.relative_to(self.root).parts
            is_live = top == self.live.name
            name = '/'.join(inner if is_live else (top, *inner))
            # A start that goes back copies all of a release.
            is_own = name in own or inner[:1] in (['wheels'], [_MANIFEST])
            is_brought = top in _BROUGHT or (is_live and is_own)
            if is_brought or path.is_dir() or '__pycache__' in inner:
                continue
            target = self.folder / 'edited' / self.system / name
            target.parent.mkdir(parents=True, exist_ok=True)
            path.rename(target)
            kept.append(target)
        return kept

    def choose(self, release: str | None) -> None:
        """Let a release be the current one, and its files those that run; `None` for no release.

        What others have written beside them stays.
        """
        before = _list_digests(self.manifest())
        after = _list_digests(self.manifest(release)) if release else {}
        for name in before.keys() - after.keys():
            (self.live / name).unlink(missing_ok=True)
            remove_empty(*[each for each in (self.live / name).parents if each != self.root])
        for name, digest in after.items():
            source, path = self.root / str(release) / name, self.live / name
            if digest_file(path) != digest:
                write_file(path, source.read_bytes(), source.stat().st_mode & 0o777)
        if release is None:
            self.current.unlink(missing_ok=True)
        else:
            write_link(self.current, release)

    def receive_part(self, data: bytes) -> None:
        """Keep the next part of a file, until the last one comes."""
        self._parts += data

    def receive(self, name: str, data: bytes = b'') -> None:
        """Keep a file whose last part has come, until it is staged."""
        write_file(self.incoming / name, self._take_parts() + data)

    def receive_wheel(self, name: str, data: bytes = b'') -> None:
        """Keep a wheel whose last part has come, for all systems."""
        write_file(self.folder / 'wheels' / Path(name).name, self._take_parts() + data)

    def _take_parts(self) -> bytes:
        taken = bytes(self._parts)
        self._parts.clear()
        return taken

    def unpack_composer(self, digest: str, wheel: str) -> None:
        """Unpack the wheel of Composer, if that has not been done."""
        target = self.folder / 'composer' / digest
        if not target.is_dir():
            _unpack(self.incoming / wheel, part := target.with_name(f'.{digest}.{os.getpid()}'))
            try:
                part.rename(target)
            except OSError:
                # Another deployment was first.
                remove_tree(part)

    def provide_venv(self, digest: str, wheels: list[str], *, sees_system: bool) -> None:
        """Make an environment with these wheels, if there is none.

        Args:
            sees_system: Whether it sees the packages of the Python that it is made with.

        Raises:
            HostError: It cannot be made.
        """
        target = self.folder / 'venvs' / digest
        target.parent.mkdir(parents=True, exist_ok=True)
        with (target.parent / f'.{digest}.lock').open('w') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not (target / 'ready').exists():
                remove_tree(target)
                try:
                    self._make_venv(target, wheels, sees_system=sees_system)
                except BaseException:
                    remove_tree(target)
                    raise
        os.utime(target / 'ready')

    def _make_venv(self, target: Path, wheels: list[str], *, sees_system: bool) -> None:
        options = ['--without-pip', *['--system-site-packages'] * sees_system]
        run([sys.executable, '-m', 'venv', *options, str(target)])
        paths = [str(self.folder / 'wheels' / name) for name in wheels]
        pip = next(path for path in paths if Path(path).name.startswith('pip-'))
        others = [path for path in paths if path != pip]
        words = ['install', '--quiet', '--no-index', '--no-deps', '--no-cache-dir', *others]
        # Of thousands of modules few are imported, and those are compiled then.
        words += ['--no-compile', '--disable-pip-version-check', '--isolated']
        run([str(target / 'bin/python'), f'{pip}/pip', *words])
        (target / 'ready').write_text(json.dumps(sorted(wheels)))

    def stage(self, manifest: dict[str, Any]) -> str:
        """Write a new release; return its link. What runs does not change.

        Raises:
            HostError: A file has not come.
        """
        number = 1 + max((int(each.name) for each in self._list_releases()), default=0)
        release = self.root / 'releases' / str(number)
        before = self.root / str(read_link(self.current))
        part = release.with_name(f'.{number}.part')
        remove_tree(part)
        for name, entry in manifest['files'].items():
            self._bring(entry, before, part / name)
        for wheel, folder in manifest['unpack'].items():
            _unpack(part / wheel, part / folder)
        write_json(part / _MANIFEST, manifest)
        part.rename(release)
        return f'releases/{number}'

    def _bring(self, entry: dict[str, Any], before: Path, path: Path) -> None:
        """Write a file of a release, from what has come or from the release before."""
        digest, mode = entry['digest'], entry['mode']
        known = (self.manifest() or {'files': {}})['files']
        sources = [self.incoming / digest]
        sources += [before / name for name, each in known.items() if each['digest'] == digest]
        for source in sources:
            if digest_file(source) == digest:
                write_file(path, source.read_bytes(), mode)
                return
        message = f'{path.name} has not arrived'
        raise HostError(message)

    def discard(self, release: str) -> None:
        """Remove a release that does not run."""
        if release and read_link(self.current) != release:
            remove_tree(self.root / release)

    def prune(self) -> None:
        """Remove what no release needs."""
        remove_tree(self.incoming)
        current = read_link(self.current)
        releases = sorted(self._list_releases(), key=lambda each: int(each.name))
        old = [each for each in releases if f'releases/{each.name}' != current]
        for each in old[: len(old) - (_KEPT - 1)]:
            remove_tree(each)
        self._prune_shared()

    def remove(self) -> None:
        """Remove all of the system, and what no other system needs."""
        remove_tree(self.root)
        self._prune_shared()
        remove_empty(self.folder / 'systems', self.folder / 'venvs', self.folder / 'composer')
        if not (self.folder / 'systems').exists():
            remove_tree(self.folder / 'wheels')
            remove_tree(self.folder / 'locks')
            remove_empty(self.folder)

    def _prune_shared(self) -> None:
        manifests = [
            found
            for path in (self.folder / 'systems').glob(f'*/releases/*/{_MANIFEST}')
            if isinstance(found := read_json(path), dict)
        ]
        for kind in ('venv', 'composer'):
            folder = self.folder / ('venvs' if kind == 'venv' else kind)
            needed = {each.get(kind) for each in manifests}
            for each in folder.glob('*'):
                # What is new may be for a release that comes.
                is_old = not manifests or time.time() - each.stat().st_mtime > _NEW_SEC
                if is_old and each.name.lstrip('.').removesuffix('.lock') not in needed:
                    remove_tree(each) if each.is_dir() else each.unlink(missing_ok=True)

    def _list_releases(self) -> list[Path]:
        found = (self.root / 'releases').glob('[0-9]*')
        return [each for each in found if each.name.isdigit()]

    def free_bytes(self) -> int:
        """Return how much the disk of the folder can take."""
        return shutil.disk_usage(self._find_disk()).free

    def may_run(self) -> bool:
        """Return whether programs may be run from the folder: its disk may be mounted `noexec`."""
        return not os.statvfs(self._find_disk()).f_flag & os.ST_NOEXEC

    def _find_disk(self) -> Path:
        """Return what there is already of the folder."""
        folder = self.folder
        while not folder.exists():
            folder = folder.parent
        return folder


def _list_digests(manifest: dict[str, Any] | None) -> dict[str, str]:
    """Return the digests of the files that run, by their paths."""
    if manifest is None:
        return {}
    files: dict[str, Any] = manifest['files']
    contents: dict[str, str] = manifest['contents']
    return contents | {
        name: str(each['digest']) for name, each in files.items() if name not in manifest['unpack']
    }


def _unpack(wheel: Path, folder: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        for info in archive.infolist():
            path = folder / info.filename
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(archive.read(info))
