"""This process: how it was started, and how its program starts again in it.

A system that must start again keeps its process, and so its ID, parent, terminal and output: the
program is executed anew, with the command line, the environment and the folder that it was
started with. What a process keeps beyond that is undone before.
"""

from __future__ import annotations

import atexit
import os
import resource
import signal
import sys
import threading
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING

from composer import signals
from composer.errors import ExitCode
from composer.processes.guardian import RLIMIT_LOCKS, tell
from composer.programs import shell_environment
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

# How long threads get to end that are no daemons.
_THREADS_SEC = 5.0
_POLL_SEC = 0.05


@record
class Start:
    """How this process was started.

    Attributes:
        variables: Its environment.
        folder: Its working directory.
        descriptors: Those that it has of its parent.
        locks: Its limits of file locks, which the guardian marks processes by.
    """

    variables: Mapping[str, str]
    folder: str
    descriptors: frozenset[int]
    locks: tuple[int, int]


_start: Start | None = None
_endings: list[Callable[[], object]] = []


def note_start() -> None:
    """Note how this process was started, before anything of it is changed."""
    global _start  # noqa: PLW0603 - a fact of the whole process
    inherited = frozenset(each for each in _descriptors() if _is_inheritable(each))
    locks = resource.getrlimit(RLIMIT_LOCKS)
    _start = Start(dict(shell_environment()), os.getcwd(), inherited, locks)  # noqa: PTH109 - as it is


def the_start() -> Start:
    """Return what `note_start` noted."""
    assert _start is not None  # noqa: S101 - who starts again has noted it
    return _start


def own_command() -> list[str]:
    """Return the command by which this process was started, without its arguments."""
    count = len(sys.argv) - 1
    options = sys.orig_argv[1 : len(sys.orig_argv) - count]
    return [sys.executable, *options]


def before_start_again(function: Callable[[], object]) -> None:
    """Have a function called as one of the last things before the program starts again."""
    _endings.append(function)


def finish(is_wanted: Callable[[], bool]) -> None:
    """Do what Python does at an exit: wait for threads, and call `atexit` functions.

    Args:
        is_wanted: Returns whether the program is still to start again.
    """
    deadline = monotonic() + _THREADS_SEC
    others = [each for each in threading.enumerate() if each is not threading.current_thread()]
    for thread in others:
        while not thread.daemon and thread.is_alive() and is_wanted() and monotonic() < deadline:
            thread.join(_POLL_SEC)
    signals.heed_at_exit()
    atexit._run_exitfuncs()  # noqa: SLF001 - an exec runs none


def start_again(is_wanted: Callable[[], bool], *endings: Callable[[], object]) -> None:
    """Execute the program anew; return if that is not wanted, for the process to end at once.

    Args:
        is_wanted: See `finish`.
        endings: Called after those of `before_start_again`.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):
            stream.flush()
    for function in (*_endings, *endings):
        function()
    try:
        _prepare(the_start())
        # From here on a signal ends the process, or waits until the program can heed it again.
        for number in signals.HANDLED:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_BLOCK, signals.HANDLED)
        if is_wanted():
            os.execve(sys.executable, sys.orig_argv, dict(the_start().variables))  # noqa: S606 - ourselves
    except OSError as error:
        tell(f'[FATAL] [composer]: the system cannot start again: {error}')
        os._exit(ExitCode.FAILED)


def _prepare(start: Start) -> None:
    """Make this process what it was at its start."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    for descriptor in _descriptors() - start.descriptors:
        with suppress(OSError):
            os.set_inheritable(descriptor, False)
    resource.setrlimit(RLIMIT_LOCKS, start.locks)
    os.chdir(start.folder)


def _descriptors() -> set[int]:
    """Return the open descriptors beyond the standard streams."""
    return {int(each) for each in os.listdir('/proc/self/fd')} - {0, 1, 2}  # noqa: PTH208 - numbers


def _is_inheritable(descriptor: int) -> bool:
    try:
        return os.get_inheritable(descriptor)
    except OSError:
        return False  # That of the listing itself.
