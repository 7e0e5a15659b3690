"""The processor time of calls, measured while somebody looks."""

from __future__ import annotations

import threading
from threading import get_ident
from time import thread_time_ns
from typing import TYPE_CHECKING

from composer.runtime.costs.interpreter_waits import InterpreterWaits
from composer.runtime.costs.thread_clock import read_thread_clock_ns

if TYPE_CHECKING:
    from composer.runtime.costs.interpreter_waits import Waits


class CallMeter:
    """Measures the processor time of calls.

    A call is given all that its thread has used since its last call ended: so what it costs to
    take a message counts, too. To read the clock of a thread takes as long as all else that is
    measured of a call.

    Attributes:
        is_on: Whether it measures.
    """

    def __init__(self) -> None:
        self.is_on = False
        self._marks: dict[int, int] = {}
        self._waits: InterpreterWaits | None = None

    def turn(self, *, on: bool) -> None:
        """Begin to measure, or end it."""
        if on == self.is_on:
            return
        if on:
            self._marks = {
                each.ident: read_thread_clock_ns(each.native_id) or 0
                for each in threading.enumerate()
                if each.ident is not None and each.native_id is not None
            }
            self._waits = InterpreterWaits()
        elif self._waits is not None:
            self.is_on = False
            self._waits.stop()
        self.is_on = on

    def lap(self) -> int:
        """Return what this thread has used since it was last asked, or it was turned on.

        It is nothing the first time in a thread that is newer than that.

        Returns:
            Time of the processor in nanoseconds.
        """
        return self._pass(get_ident(), thread_time_ns())

    def lap_of(self, thread: int, native: int) -> int:
        """Return the same of another thread, which may have ended.

        Args:
            thread: Its identifier.
            native: Its number in the system.
        """
        now_ns = read_thread_clock_ns(native)
        return 0 if now_ns is None else self._pass(thread, now_ns)

    def _pass(self, thread: int, now_ns: int) -> int:
        # Taken away, so that of two who ask at once one gets nothing.
        before_ns = self._marks.pop(thread, None)
        self._marks[thread] = now_ns
        return 0 if before_ns is None else max(0, now_ns - before_ns)

    def take_waits(self) -> Waits | None:
        """Return how long others waited for the interpreter since this was last asked."""
        return None if self._waits is None else self._waits.take()


call_meter = CallMeter()
