"""A file that holds a system back while it is there: see `composer up --hold`.

So the parts of a system on several hosts start their behaviours together: who starts them waits
until each is held, and removes the files.
"""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from composer.errors import StartError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_POLL_SEC = 0.02
# Who has forgotten it does not come back.
_LONGEST_SEC = 60.0


def wait_until_let_go(path: Path, is_stopping: Callable[[], bool]) -> None:
    """Write the process ID to a file, and wait until the file is gone; without it, do nothing.

    Args:
        is_stopping: Returns whether to wait no longer.

    Raises:
        StartError: It was there for too long, and is removed; or it cannot be written.
    """
    try:
        with path.open('r+') as stream:
            stream.write(f'{os.getpid()}\n')
    except FileNotFoundError:
        return
    except OSError as error:
        message = f'the system cannot tell that it is held: {path}: {error.strerror}'
        raise StartError(message) from error
    deadline = time.monotonic() + _LONGEST_SEC
    while path.exists() and not is_stopping():
        if time.monotonic() > deadline:
            path.unlink(missing_ok=True)
            message = f'nobody has removed {path} within {_LONGEST_SEC:g} s'
            raise StartError(message)
        time.sleep(_POLL_SEC)
