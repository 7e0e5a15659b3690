"""A rehearsal: another process does all that a start does before the system is created.

So a system that must start again is stopped only if it can: its interface packages are built, its
middleware is there, and its behaviours can be imported beside them.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.processes.own_process import own_command, the_start

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.runtime.system import System

_LOOK_SEC = 0.2
_CHUNK = 1 << 16
OPTION = '--rehearse'


def rehearse(system: System, is_outdated: Callable[[], bool]) -> None:
    """Rehearse the start of a system that runs in this process.

    Args:
        is_outdated: Returns whether there is a newer edit; asked again and again.

    Raises:
        ComposerError: The start would fail, with what was printed, or the system stops, or there
            is a newer edit.
    """
    start = the_start()
    process = subprocess.Popen(  # noqa: S603 - ourselves
        # The first argument is the command, `up`.
        [*own_command(), sys.argv[1], OPTION, *sys.argv[2:]],
        stdin=subprocess.DEVNULL,
        # What modules of behaviours print when they are imported.
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env=dict(start.variables),
        cwd=start.folder,
        # A signal of the terminal goes to Composer alone. What builds packages is in it, too.
        start_new_session=True,
    )

    def end() -> None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    printed = b''
    with process, system.ending(end) as goes_on:
        if not goes_on:
            end()
        while chunk := _read(process, is_outdated, end):
            printed += chunk
        # Until then its ID is that of no other process.
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    if process.returncode:
        text = printed.decode(errors='backslashreplace').strip()
        raise ComposerError(text or 'the files have changed, or the system stops')


def _read(
    process: subprocess.Popen[bytes], is_outdated: Callable[[], bool], end: Callable[[], None]
) -> bytes:
    assert process.stderr is not None  # noqa: S101 - it is a pipe
    while not select.select([process.stderr], [], [], _LOOK_SEC)[0]:
        if is_outdated():
            end()
    return os.read(process.stderr.fileno(), _CHUNK)
