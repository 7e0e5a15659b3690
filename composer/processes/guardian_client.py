"""Starts the guardian, the process that ends this one where it cannot end itself."""

from __future__ import annotations

import errno
import faulthandler
import os
import resource
import select
import signal
import subprocess
import sys
from contextlib import suppress
from functools import cache
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from composer.processes import guardian

if TYPE_CHECKING:
    from composer.terminal import EscapingLogger

_MARK_BYTES = 7
_POLL_SEC = 0.02
_BEAT_SEC = 1.0
_GONE_SEC = 2.0


class GuardianClient:
    """Starts the guardian, and tells it about a stop.

    Args:
        stop_sec: How long a stop may take.
        exit_sec: How long Python may take to exit after it.
        owns_process: Whether this process exits with the system, to which all processes that it
            starts from now on belong.

    Attributes:
        owns_process: As given.
        descriptor: For `signal.set_wakeup_fd`.
        mark: What marks the processes that belong to the system; 0 if nothing does.
    """

    def __init__(self, stop_sec: float, exit_sec: float, *, owns_process: bool) -> None:
        self.owns_process = owns_process
        self.mark = 0
        reports, self.descriptor = os.pipe2(os.O_CLOEXEC | os.O_NONBLOCK)
        self._inode = os.fstat(self.descriptor).st_ino
        self._beat = 0.0
        print_stacks_at_signal()
        mark = _create_mark() if owns_process else 0
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own script
                [
                    *(sys.executable, '-I', '-S', guardian.__file__),
                    *map(str, (os.getpid(), reports, stop_sec, exit_sec, mark)),
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=(reports,),
                start_new_session=True,
            )
        finally:
            os.close(reports)
        if mark and _set_mark(mark):
            self.mark = mark

    def wait_until_begun(self) -> None:
        """Wait until the guardian is no child of this process any more."""
        self._process.wait()

    def allow(self, stop_sec: float) -> None:
        """Let a stop take so long from now on."""
        self._send(guardian.LIMIT, guardian.SECONDS.pack(stop_sec))

    def beat(self) -> None:
        """Tell that Python code runs; called often, it does so once a second."""
        if (now := monotonic()) - self._beat >= _BEAT_SEC:
            self._beat = now
            # A debugger of IDEs stops the thread that calls this, too.
            self._send(guardian.PAUSE if 'pydevd' in sys.modules else guardian.BEAT)

    def begin_stop(self) -> bool:
        """Let the time of a stop run; return whether the guardian can be told."""
        return self._send(guardian.BEGUN)

    def end_stop(self) -> None:
        """Let the time of the exit run instead."""
        self._send(guardian.OVER)

    def send_away(self) -> None:
        """Let the guardian end: this process goes on."""
        self._send(guardian.LEAVE)
        with suppress(OSError):
            os.close(self.descriptor)

    def wait_until_gone(self) -> None:
        """Let the guardian end, and wait for that: this process exits, and another one guards it.

        What it has started and left is for that one, too.
        """
        if self._send(guardian.LEAVE):
            # Nobody reads from the pipe any more.
            poll = select.poll()
            poll.register(self.descriptor, 0)
            poll.poll(_GONE_SEC * 1000)

    def _send(self, byte: int, rest: bytes = b'') -> bool:
        # A behaviour may have closed it; then the guardian stops the system. Its number may be
        # that of something else by now.
        try:
            if os.fstat(self.descriptor).st_ino != self._inode:
                return False
            os.write(self.descriptor, bytes([byte]) + rest)
        except OSError as error:
            return error.errno != errno.EBADF
        return True


class NoGuardian:
    """Stands for a guardian where something else ends a process that hangs.

    Args:
        owns_process: See `GuardianClient`.
    """

    mark = 0

    def __init__(self, *, owns_process: bool) -> None:
        self.owns_process = owns_process

    def allow(self, _stop_sec: float) -> None:
        """Do nothing."""

    def beat(self) -> None:
        """Do nothing."""

    def begin_stop(self) -> bool:
        """Tell that the stop goes on."""
        return True


def _create_mark() -> int:
    return int.from_bytes(os.urandom(_MARK_BYTES), 'big')


def mark_process() -> int:
    """Mark this process, and all that it starts from now on; return the mark, 0 for none."""
    mark = _create_mark()
    return mark if _set_mark(mark) else 0


def _set_mark(mark: int) -> bool:
    _, hard = resource.getrlimit(guardian.RLIMIT_LOCKS)
    try:
        resource.setrlimit(guardian.RLIMIT_LOCKS, (mark, hard))
    except (OSError, ValueError):
        # The limit of this process is lower already.
        return False
    return True


def _find_marked(mark: int) -> dict[int, str]:
    # Where a behaviour has used up all descriptors, the guardian ends them afterwards.
    with suppress(OSError):
        return guardian.find_marked(mark)
    return {}


def end_marked(mark: int, timeout_sec: float, logger: EscapingLogger) -> bool:
    """End all processes that bear a mark, and log which.

    Returns:
        Whether none had to be killed.
    """
    deadline = monotonic() + timeout_sec
    known: set[int] = set()
    while found := _find_marked(mark):
        if monotonic() > deadline:
            guardian.kill_marked(mark)
            return False
        for pid in sorted(found.keys() - known):
            logger.warning(
                f'process {pid} ({found[pid]}), which a behaviour has started, still runs: '
                'it is ended'
            )
            for number in (signal.SIGTERM, signal.SIGCONT):
                with suppress(ProcessLookupError, PermissionError):
                    os.kill(pid, number)
        known |= found.keys()
        sleep(_POLL_SEC)
    return True


@cache
def print_stacks_at_signal() -> None:
    """Let the guardian's signal, and crashes, print the stacks of all threads."""
    # When Python exits, it restores what was before its own handler. Only the main thread may.
    with suppress(ValueError):
        signal.signal(guardian.STACKS_SIGNAL, signal.SIG_IGN)
    with suppress(AttributeError, RuntimeError, ValueError):
        # There may be no standard error.
        stderr: Any = sys.__stderr__
        faulthandler.register(guardian.STACKS_SIGNAL, file=stderr, all_threads=True)
        if not faulthandler.is_enabled():
            faulthandler.enable(file=stderr)
