"""Shared memory of Fast DDS that processes left which were killed.

Each process has a segment of half a megabyte, or of 16 with workers, and beside it a file that it
keeps locked, by `flock`, for as long as it lives. A port of shared memory is left too, but the
next process with its number takes it over.
Source: RobustExclusiveLock.hpp and SharedMemManager.hpp of Fast DDS 2 and 3
"""

from __future__ import annotations

import fcntl
import os
import re
import stat
import time
from contextlib import suppress
from pathlib import Path

_FOLDER = Path('/dev/shm')  # noqa: S108 - where shm_open of Linux has its files
_LOCK_NAME = re.compile('((?:fastrtps|fastdds)_[0-9a-f]{16})_el')
# A process creates the file first and locks it then.
_LEAST_AGE_SEC = 10.0


def remove_left_segments() -> None:
    """Remove the segments of this user that no process has locked."""
    with suppress(OSError):
        for path in _FOLDER.iterdir():
            if match := _LOCK_NAME.fullmatch(path.name):
                with suppress(OSError):
                    _remove_if_left(path, _FOLDER / match[1])


def _remove_if_left(lock: Path, segment: Path) -> None:
    descriptor = os.open(lock, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        status = os.fstat(descriptor)
        if not _is_own_file(status) or time.time() - status.st_mtime < _LEAST_AGE_SEC:
            return
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # Another start may have removed it before it was locked here.
        if not os.path.samestat(status, lock.lstat()):
            return
        with suppress(FileNotFoundError):
            if not _is_own_file(segment.lstat()):
                return
            segment.unlink()
        lock.unlink()
    finally:
        os.close(descriptor)


def _is_own_file(status: os.stat_result) -> bool:
    return stat.S_ISREG(status.st_mode) and status.st_uid == os.geteuid()
