"""Shared memory of Fast DDS that killed processes left.

Each process has a segment of half a megabyte, or of 16 with workers, and receives at ports. Beside
each is a file that the process keeps locked, by `flock`, for as long as it lives.
Source: RobustExclusiveLock.hpp, SharedMemManager.hpp and SharedMemGlobal.hpp of Fast DDS 2 and 3
"""

from __future__ import annotations

import fcntl
import math
import os
import re
import stat
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_FOLDER = Path('/dev/shm')  # noqa: S108 - where shm_open of Linux has its files
_LOCK_NAME = re.compile('((?:fastrtps|fastdds)_[0-9a-f]{16})_el')
_PORT_LOCK_NAME = re.compile('(?:fastrtps|fastdds)_port[0-9]+_el')
# A process creates the file first and locks it then.
_LEAST_AGE_SEC = 10.0


class LeftPorts:
    """Keeps the ports of killed processes from being used again.

    Those that sent to a process go on sending to its port after it was killed, also once another
    process has a port of this number. Fast DDS takes the next number for a port that is locked.
    (https://github.com/eProsima/Fast-DDS/issues/5469)
    """

    def __init__(self) -> None:
        # Older ones are of other systems: as long as none is locked, they are used again.
        self._since = time.time() - _LEAST_AGE_SEC
        self._locked: list[tuple[Path, int]] = []
        self._lock = threading.Lock()

    def lock(self) -> None:
        """Lock the ports of all processes that were killed by now."""
        with self._lock:
            # If it was removed since, its senders know, and Fast DDS logs an error for its lock.
            for each in [each for each in self._locked if not _resource_of(each[0]).exists()]:
                self._locked.remove(each)
                os.close(each[1])
            for path in _list_files(_PORT_LOCK_NAME):
                with suppress(OSError):
                    if _resource_of(path).exists():
                        self._locked.append((path, _lock(path, since=self._since)))

    def close(self) -> None:
        """Leave them to Fast DDS."""
        with self._lock:
            while self._locked:
                os.close(self._locked.pop()[1])


def remove_left_segments() -> None:
    """Remove the segments of this user that no process has locked."""
    for path in _list_files(_LOCK_NAME):
        with suppress(OSError):
            _remove_if_left(path, _resource_of(path))


def _resource_of(lock: Path) -> Path:
    """Return the segment or port of a lock file."""
    return lock.with_name(lock.name.removesuffix('_el'))


def _list_files(name: re.Pattern[str]) -> Iterator[Path]:
    with suppress(OSError):
        yield from (path for path in _FOLDER.iterdir() if name.fullmatch(path.name))


def _remove_if_left(lock: Path, segment: Path) -> None:
    descriptor = _lock(lock, until=time.time() - _LEAST_AGE_SEC)
    try:
        with suppress(FileNotFoundError):
            if not _is_own_file(segment.lstat()):
                return
            segment.unlink()
        lock.unlink()
    finally:
        os.close(descriptor)


def _lock(path: Path, *, since: float = 0.0, until: float = math.inf) -> int:
    """Lock a file that nobody has locked; return its descriptor.

    Args:
        since, until: When it was created, in seconds of the epoch.

    Raises:
        OSError: It is locked, of another time, or not a file of this user.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        status = os.fstat(descriptor)
        if not (_is_own_file(status) and since <= status.st_mtime <= until):
            raise PermissionError(path)
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # Another start may have removed it before it was locked here.
        if not os.path.samestat(status, path.lstat()):
            raise FileNotFoundError(path)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _is_own_file(status: os.stat_result) -> bool:
    return stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
