"""Edits of files: where they are seen, and when a file is written."""

from __future__ import annotations

import errno
import fcntl
import os
import signal
from pathlib import Path
from time import monotonic, time_ns
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Collection, Iterable, Iterator

# Changes of these files may change a system; parameter files may have any name.
_SUFFIXES = ('.yaml', '.yml', '.py', '.msg', '.srv', '.action')
# What the kernel tells within a step, and at most within the time of a debounce, is one change.
_STEP_MS = 10
_DEBOUNCE_MS = 100
# Nothing tells of edits on some network drives, nor of those before the watch began.
_LOOK_MS = 500
# A program that keeps a file open for writing, and writes nothing for so long, has written it.
_WRITTEN_SEC = 2.0
# Editors that truncate or remove a file first write it within this time.
_STILL_SEC = 0.25
_POLL_SEC = 0.01
# As many links as Linux follows in one path.
_MOST_LINKS = 40

Stamp: TypeAlias = tuple[int, ...]
# Where a stamp has the time of the last change, which a clock with such steps tells.
_CHANGED = 2
_CLOCK_NS = 20_000_000


class WatchedFiles:
    """The files that a system is read from, and those that it lacks.

    Args:
        files: Their paths, as they are named; links in them are followed anew each time.
        begun_ns: When they began to be read, on the system's clock; by default just now.
    """

    def __init__(self, files: Iterable[Path], begun_ns: int | None = None) -> None:
        self._files: set[Path] = set()
        self._stamps: dict[Path, Stamp | None] = {}
        self._begun_ns = time_ns() if begun_ns is None else begun_ns
        self.follow(files)

    def note_reading(self) -> None:
        """Take what the files are now as known: they are read next."""
        self._begun_ns = time_ns()
        self._stamps = _stamps_of(self._files)

    def follow(self, files: Iterable[Path]) -> None:
        """Watch these files instead of those before; what is new among them has been read."""
        wanted = {Path.cwd() / each for each in files}
        stamps = self._stamps.copy()
        for path, stamp in _stamps_of(wanted - self._files).items():
            # Those that were written since the reading began may have been read before that.
            is_newer = stamp is not None and stamp[_CHANGED] > self._begun_ns - _CLOCK_NS
            stamps[path] = () if is_newer else stamp
        self._stamps, self._files = stamps, wanted

    def also_follow(self, files: Iterable[Path]) -> None:
        """Watch these files, too."""
        self.follow([*self._files, *files])

    def list_changed(self) -> list[Path]:
        """Return the files that are not as they were when they were read."""
        return [
            path
            for path, stamp in _stamps_of(self._files).items()
            if self._stamps.get(path) != stamp
        ]

    def are_still(self, ended: threading.Event) -> bool:
        """Return whether no file changes for as long as it takes an editor to write one."""
        until = monotonic() + _STILL_SEC
        while monotonic() < until and not ended.is_set():
            if self.list_changed():
                return False
            ended.wait(_POLL_SEC)
        return True

    def edits(self, ended: threading.Event, log: Callable[[str], object]) -> Iterator[None]:
        """Yield after each edit of a file, when it has been written, until `ended`.

        Args:
            log: Is told if the kernel cannot report changes; they are looked for then.
        """
        was_told = False
        while not ended.is_set():
            trails = self._find_trails()
            try:
                for changed in _watch(*trails, ended):
                    if changed or self.list_changed():
                        self._wait_until_written(ended)
                        yield
                    if self._find_trails() != trails:
                        break
            except (ImportError, OSError, RuntimeError) as error:
                # A folder has just gone, or the limits of inotify are reached.
                if not (was_told or isinstance(error, FileNotFoundError)):
                    was_told = True
                    log(f'files are looked at twice a second: {_reason_of(error)}')
                if self.list_changed():
                    self._wait_until_written(ended)
                    yield
                ended.wait(_LOOK_MS / 1000)

    def _wait_until_written(self, ended: threading.Event) -> None:
        """Wait while a changed file is open for writing, as long as something is written."""
        until = monotonic() + _WRITTEN_SEC
        stamps: dict[Path, Stamp | None] = {}
        changed = self.list_changed()
        while any(map(_is_being_written, changed)) and not ended.wait(_POLL_SEC):
            if stamps != (stamps := _stamps_of(changed)):
                until = monotonic() + _WRITTEN_SEC
            elif monotonic() > until:
                return
            changed = self.list_changed()

    def _find_trails(self) -> tuple[set[Path], dict[Path, Stamp]]:
        """Return the files and the links on the way to them, and the folders that these are in.

        Folders come with their inodes: one that was made anew has to be watched anew.
        """
        entries: set[Path] = set()
        folders: dict[Path, Path] = {}
        for path in self._files:
            if path.parent not in folders:
                *links, end = _list_trail(path.parent)
                entries |= {*links} if end.is_dir() else {*links, end}
                folders[path.parent] = end
            entries |= {*_list_trail(folders[path.parent] / path.name)}
        inodes = _stamps_of({each.parent for each in entries}, only_inode=True)
        return entries, {path: inode for path, inode in inodes.items() if inode}


def _watch(
    entries: set[Path], folders: Collection[Path], ended: threading.Event
) -> Iterator[object]:
    """Yield what changes in folders, and nothing at times, until `ended`."""
    from watchfiles import watch

    return watch(
        *folders,
        watch_filter=lambda _change, path: path.endswith(_SUFFIXES) or Path(path) in entries,
        stop_event=ended,
        step=_STEP_MS,
        debounce=_DEBOUNCE_MS,
        rust_timeout=_LOOK_MS,
        yield_on_timeout=True,
        recursive=False,
    )


def _list_trail(path: Path) -> list[Path]:
    """Return the links that an absolute path leads through, and its end.

    None of them has links in its own folder. The end is the first part that is missing, if any is.
    """
    trail: list[Path] = []
    here, pending = Path(path.anchor), [*reversed(path.parts[1:])]
    while pending and len(trail) < _MOST_LINKS:
        part = pending.pop()
        entry = here.parent if part == '..' else here / part
        try:
            target = entry.readlink()
        except OSError:
            here = entry
            if pending and not entry.is_dir():
                break
            continue
        trail.append(entry)
        if target.is_absolute():
            here = Path(target.anchor)
        pending += reversed(target.parts[1:] if target.is_absolute() else target.parts)
    return [*trail, here]


def _is_being_written(path: Path) -> bool:
    """Return whether somebody has a file open for writing: Linux grants no lease of it then."""
    try:
        if not path.is_file():
            return False
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        # The signal for who opens it meanwhile would end the process; this one is ignored.
        fcntl.fcntl(descriptor, fcntl.F_SETSIG, signal.SIGURG)
        fcntl.fcntl(descriptor, fcntl.F_SETLEASE, fcntl.F_RDLCK)
        fcntl.fcntl(descriptor, fcntl.F_SETLEASE, fcntl.F_UNLCK)
    except OSError as error:
        # Some file systems know no leases, and nobody leases a file of another user.
        return error.errno == errno.EAGAIN
    else:
        return False
    finally:
        os.close(descriptor)


def _stamps_of(paths: Iterable[Path], *, only_inode: bool = False) -> dict[Path, Stamp | None]:
    """Return what changes when a file is written, replaced or made readable; `None` for none."""
    stamps: dict[Path, Stamp | None] = {}
    for path in paths:
        try:
            status = path.stat()
        except OSError:
            stamps[path] = None
        else:
            inode = status.st_ino, status.st_dev
            rest = status.st_ctime_ns, status.st_mtime_ns, status.st_size
            stamps[path] = inode if only_inode else (*inode, *rest)
    return stamps


def _reason_of(error: Exception) -> str:
    """Return why the kernel cannot report changes, in one line and without paths."""
    if isinstance(error, ImportError):
        return 'watchfiles is not installed (pip install watchfiles)'
    return str(error).partition(' about [')[0].partition('\n')[0].rstrip('.')
