"""A rehearsal: another process does all that a start does before the system is created.

So a system that must start again is stopped only if it can: its interface packages are built, its
middleware is there, and its behaviours can be imported beside them.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from composer.errors import ComposerError
from composer.processes.own_process import own_command, the_start

if TYPE_CHECKING:
    from composer.runtime.system import System

OPTION = '--rehearse'


def rehearse(system: System) -> None:
    """Rehearse the start of a system that runs in this process; what that prints is printed.

    Raises:
        ComposerError: The start would fail, with what was printed, or the system stops.
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
        text=True,
        errors='backslashreplace',
        # A signal of the terminal goes to Composer alone. What builds packages is in it, too.
        start_new_session=True,
    )

    def end() -> None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    lines = []
    with process, system.ending(end) as goes_on:
        if not goes_on:
            end()
        for line in process.stderr or ():
            lines.append(line)
            click.echo(line, nl=False, err=True)
        # Until then its ID is that of no other process.
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    if process.returncode:
        raise ComposerError(''.join(lines).strip() or 'the system stops')
