"""The folder of temporary files of external processes, such as their parameter files.

It goes with the system: its own process removes it, or the reaper if that was killed. If both are
killed at once, the next start removes it: it is locked, by `flock`, as long as its process lives.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path

_PREFIX = 'composer-processes-'
# A process creates the folder first and locks it then.
_LEAST_AGE_SEC = 10.0


class ProcessFolder:
    """A new folder; those of systems whose processes were all killed are removed.

    Attributes:
        path: Where it is.
    """

    def __init__(self) -> None:
        _remove_left()
        self._folder = tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True)
        self.path = Path(self._folder.name)
        self._lock = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def remove(self) -> None:
        """Remove it, with all that is in it."""
        self._folder.cleanup()
        # A behaviour may have closed it.
        with suppress(OSError):
            os.close(self._lock)


def _remove_left() -> None:
    with suppress(OSError):
        for path in Path(tempfile.gettempdir()).iterdir():
            if path.name.startswith(_PREFIX):
                with suppress(OSError):
                    _remove_if_left(path)


def _remove_if_left(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        status = os.fstat(descriptor)
        is_young = time.time() - status.st_mtime < _LEAST_AGE_SEC
        if status.st_uid == os.geteuid() and not is_young:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(path, ignore_errors=True)
    finally:
        os.close(descriptor)
