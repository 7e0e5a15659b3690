"""Threads that never wait: virtual time would stand still for ever."""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

from composer.errors import ComposerError
from composer.runtime.costs.thread_clock import read_thread_clock_ns
from composer.virtual_time.originals import REAL
from composer.virtual_time.preemption import is_own_code

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.virtual_time.simulated_thread import SimulatedThread

# A thread that waits in C does no work: it may take so much longer.
_WAITED_FACTOR: Final = 3
# What a thread that was given up gets to end.
_END_SEC: Final = 1.0
_LOOK_SEC: Final = 0.01
_NS_PER_SEC: Final = 1e9
# How many threads an error names.
_MOST_PLACES: Final = 5


class SimulationStuckError(ComposerError):
    """A thread used more real time than allowed, without ever waiting.

    Attributes:
        thread: The identifier of the thread.
    """

    def __init__(self, thread: int, limit_sec: float) -> None:
        message = f'no virtual time passed within {limit_sec:g} s of real time'
        advice = 'virtual time passes only while everything waits; a loop without waits never ends'
        super().__init__(message, help=advice)
        self.thread = thread


def describe_waits(threads: Iterable[SimulatedThread]) -> str | None:
    """Return where the code of a project waits in these threads; `None` if it does nowhere."""
    frames = sys._current_frames()  # noqa: SLF001 - the only way
    places = []
    for thread in threads:
        frame = frames.get(thread.ident) if not thread.is_over else None
        while frame is not None and not is_own_code(frame.f_code.co_filename):
            frame = frame.f_back
        if frame is not None:
            code = frame.f_code
            places.append(f'{Path(code.co_filename).name}:{frame.f_lineno} in {code.co_name}')
    if not places:
        return None
    more = len(places) - _MOST_PLACES
    listed = ', '.join(places[:_MOST_PLACES]) + (f' and {more} more' if more > 0 else '')
    return f'behaviours wait at {listed}'


class StuckWatch:
    """Looks, in real time, whether threads that take turns go on.

    Its own work counts for a thread: on a crowded machine it may have to wait for a processor.

    Args:
        limit_sec: How much processor time a thread may use without a wait.
    """

    def __init__(self, limit_sec: float) -> None:
        self._limit_sec = limit_sec
        self._seen: object = None
        self._real_sec = self._work_sec = 0.0
        self._stuck: SimulatedThread | None = None

    def begin(self, progress: object, thread: SimulatedThread | None) -> None:
        """Look from now on: at what changes when a thread waits, and at whose turn it is."""
        self._seen = progress
        self._real_sec, self._work_sec = REAL.monotonic(), _work_of(thread)

    def is_stuck(self, progress: object, thread: SimulatedThread | None) -> bool:
        """Tell whether the thread whose turn it is has not waited for too long."""
        if progress != self._seen:
            self.begin(progress, thread)
            return False
        return (
            _work_of(thread) - self._work_sec > self._limit_sec
            or REAL.monotonic() - self._real_sec > _WAITED_FACTOR * self._limit_sec
        )

    def give_up(self, thread: SimulatedThread | None) -> SimulationStuckError:
        """Let a thread take no more turns; return the error that says so."""
        self._stuck = thread
        if thread is not None:
            thread.is_ending = True
        return SimulationStuckError(thread.ident if thread else 0, self._limit_sec)

    def end(self) -> None:
        """End the thread that was given up, at its next line of Python."""
        stuck, self._stuck = self._stuck, None
        if stuck is None:
            return
        until = REAL.monotonic() + _END_SEC
        ident, error = ctypes.c_ulong(stuck.ident), ctypes.py_object(SystemExit)
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ident, error)
        while not stuck.is_over and REAL.monotonic() < until:
            REAL.sleep(_LOOK_SEC)


def _work_of(thread: SimulatedThread | None) -> float:
    """Return how much processor time a thread has used, in seconds; 0 if it has ended."""
    if thread is None or not thread.native:
        return 0.0
    return (read_thread_clock_ns(thread.native) or 0) / _NS_PER_SEC
