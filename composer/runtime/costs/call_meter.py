"""What calls cost the processor, and how long they hold the interpreter, while somebody looks."""

from __future__ import annotations

import threading
from threading import get_ident
from time import thread_time_ns
from typing import TYPE_CHECKING

from composer.runtime.costs.interpreter_waits import InterpreterWaits
from composer.runtime.costs.lock_holders import LockHolders, Sampled
from composer.runtime.costs.thread_clock import read_thread_clock_ns

if TYPE_CHECKING:
    from composer.runtime.costs.interpreter_waits import Waits

_NOTHING = 0, 0


class CallMeter:
    """Measures what calls cost.

    A call is given all that its thread has used since its last call ended: so what it costs to
    take a message counts, too. To read the clock of a thread takes as long as all else that is
    measured of a call.

    Attributes:
        is_on: Whether it measures.
    """

    def __init__(self) -> None:
        self.is_on = False
        self._marks: dict[int, tuple[int, int]] = {}
        self._holders: LockHolders | None = None
        self._waits: InterpreterWaits | None = None

    def turn(self, *, on: bool) -> None:
        """Begin to measure, go on with it, or end it."""
        if on == self.is_on:
            if self.is_on and self._holders is not None:
                self._holders.go_on()
            return
        if on:
            self._marks = {
                each.ident: (read_thread_clock_ns(each.native_id) or 0, 0)
                for each in threading.enumerate()
                if each.ident is not None and each.native_id is not None
            }
            self._holders, self._waits = LockHolders(), InterpreterWaits()
        elif self._holders is not None and self._waits is not None:
            self.is_on = False
            self._holders.stop()
            self._waits.stop()
        self.is_on = on

    def lap(self) -> tuple[int, int]:
        """Return what this thread has used since it was last asked, or it was turned on.

        It is nothing the first time in a thread that is newer than that.

        Returns:
            Time of the processor, and how long it held the interpreter, in nanoseconds.
        """
        return self._pass(get_ident(), thread_time_ns())

    def lap_of(self, thread: int, native: int) -> tuple[int, int]:
        """Return the same of another thread, which may have ended.

        Args:
            thread: Its identifier.
            native: Its number in the system.
        """
        now_ns = read_thread_clock_ns(native)
        return _NOTHING if now_ns is None else self._pass(thread, now_ns)

    def _pass(self, thread: int, cpu_ns: int) -> tuple[int, int]:
        holders = self._holders
        held_ns = 0 if holders is None else holders.held_ns(thread)
        # Taken away, so that of two who ask at once one gets nothing.
        before = self._marks.pop(thread, None)
        self._marks[thread] = cpu_ns, held_ns
        if before is None:
            return _NOTHING
        return max(0, cpu_ns - before[0]), max(0, held_ns - before[1])

    def sampled(self) -> Sampled:
        """Return how long holders of the interpreter have been sampled since it was turned on."""
        return Sampled(0, 0) if self._holders is None else self._holders.sampled()

    @property
    def is_sampling(self) -> bool:
        """Whether holders of the interpreter are sampled, or soon will be."""
        return self._holders is not None and self._holders.is_running

    def take_waits(self) -> Waits | None:
        """Return how long others waited for the interpreter since this was last asked."""
        return None if self._waits is None else self._waits.take()


call_meter = CallMeter()
