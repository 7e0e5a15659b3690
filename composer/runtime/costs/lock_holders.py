"""How long each thread of this process holds the interpreter, as another process samples it."""

from __future__ import annotations

import ctypes
import mmap
import os
import subprocess
import sys
from contextlib import suppress
from time import monotonic

from composer.records import record
from composer.runtime.costs import lock_sampler
from composer.runtime.costs.lock_field import find_lock_field

_PR_SET_PTRACER = 0x59616D61
# How long it takes until it is tried again what has failed.
_AGAIN_SEC = 5.0


@record
class Sampled:
    """What was sampled since the start.

    Attributes:
        elapsed_ns: How long it was sampled.
        held_ns: How long a thread held the interpreter in that time, whichever it was.
    """

    elapsed_ns: int
    held_ns: int


class LockHolders:
    """Samples from its creation to `stop`.

    Where Python is built otherwise, or a process may not read another one, nothing is sampled.
    """

    def __init__(self) -> None:
        self._places: dict[int, int] = {}
        self._table = memoryview(mmap.mmap(-1, lock_sampler.TABLE_SIZE)).cast('Q')
        self._process: subprocess.Popen[bytes] | None = None
        self._tried_at = -_AGAIN_SEC
        self.go_on()

    def go_on(self) -> None:
        """Start the sampler if it does not run: it was killed, say, or could not be started."""
        now = monotonic()
        if self.is_running or now < self._tried_at + _AGAIN_SEC or not sys.executable:
            return
        self._tried_at = now
        # Without it there are no figures, and that is all.
        with suppress(LookupError, OSError):
            field = find_lock_field()
            descriptor = os.memfd_create('composer-lock-holders')
            try:
                self._use_table(descriptor)
                arguments = os.getpid(), descriptor, field.holder, field.thread_offset
                self._start(descriptor, [str(each) for each in arguments])
            finally:
                os.close(descriptor)

    def _use_table(self, descriptor: int) -> None:
        """Let a table be in a file, with what was sampled before."""
        os.ftruncate(descriptor, lock_sampler.TABLE_SIZE)
        table = memoryview(mmap.mmap(descriptor, lock_sampler.TABLE_SIZE)).cast('Q')
        table[:] = self._table
        self._table = table

    def _start(self, descriptor: int, arguments: list[str]) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - our own script
            [sys.executable, '-I', '-S', lock_sampler.__file__, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=(descriptor,),
            start_new_session=True,
        )
        # Where Yama lets only parents read their children; elsewhere this does nothing.
        # Source: https://docs.kernel.org/admin-guide/LSM/Yama.html
        ctypes.CDLL(None).prctl(_PR_SET_PTRACER, ctypes.c_ulong(self._process.pid), 0, 0, 0)
        assert self._process.stdin is not None  # noqa: S101 - a pipe
        with self._process.stdin as begin:
            begin.write(b'\n')

    @property
    def is_running(self) -> bool:
        """Whether there are samples, or may still be."""
        return self._process is not None and self._process.poll() is None

    def sampled(self) -> Sampled:
        """Return what was sampled."""
        return Sampled(self._table[lock_sampler.ELAPSED], self._table[lock_sampler.HELD])

    def held_ns(self, thread: int) -> int:
        """Return how long a thread held the interpreter.

        Args:
            thread: Its identifier.
        """
        place = self._places.get(thread)
        if place is None:
            place = self._find_place(thread)
        return self._table[place] if place else 0

    def _find_place(self, thread: int) -> int:
        """Return where the time of a thread is; 0 if it was not seen yet."""
        table = self._table
        if table[lock_sampler.THREADS] == len(self._places):
            return 0
        for number in range(table[lock_sampler.THREADS]):
            place = lock_sampler.FIRST + 2 * number
            self._places[table[place]] = place + 1
        return self._places.get(thread, 0)

    def stop(self) -> None:
        """Sample no more."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
