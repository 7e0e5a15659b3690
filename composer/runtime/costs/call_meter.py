"""The processor time of calls, measured while somebody looks."""

from __future__ import annotations

import threading
from threading import get_ident
from time import monotonic_ns, thread_time_ns
from typing import TYPE_CHECKING, Final, Protocol

from composer.runtime.costs.interpreter_waits import InterpreterWaits
from composer.runtime.costs.thread_clock import read_thread_clock_ns

if TYPE_CHECKING:
    from composer.runtime.costs.interpreter_waits import Waits

_SHORT_NS: Final = 1_000_000
_READ_NS: Final = 10_000_000


class Costs(Protocol):
    """What a call adds to.

    Attributes:
        cpu_ns: Time of the processor.
    """

    cpu_ns: int


class _Mark:
    """What a thread had used when its clock was read last, and when that was.

    Attributes:
        short: The calls that have ended since, and how long they took.
    """

    __slots__ = ('read_ns', 'short', 'used_ns')

    def __init__(self, used_ns: int) -> None:
        self.used_ns = used_ns
        self.read_ns = monotonic_ns()
        self.short: list[tuple[Costs, int]] = []


class CallMeter:
    """Measures the processor time of calls.

    A call is given all that its thread has used since its last call ended: so what it costs to
    take a message counts, too. To read the clock of a thread takes as long as all else that is
    measured of a call, so short calls in quick succession share what they have used, by how long
    they took.

    Attributes:
        is_on: Whether it measures.
    """

    def __init__(self) -> None:
        self.is_on = False
        self._marks: dict[int, _Mark] = {}
        self._waits: InterpreterWaits | None = None

    def turn(self, *, on: bool) -> None:
        """Begin to measure, or end it."""
        if on == self.is_on:
            return
        if on:
            self._marks = {
                each.ident: _Mark(read_thread_clock_ns(each.native_id) or 0)
                for each in threading.enumerate()
                if each.ident is not None and each.native_id is not None
            }
            self._waits = InterpreterWaits()
        elif self._waits is not None:
            self.is_on = False
            self._waits.stop()
        self.is_on = on

    def charge(self, costs: Costs, duration_ns: int) -> None:
        """Add what a call has used that has just ended in this thread, now or soon.

        It is nothing the first time in a thread that is newer than the measurement.
        """
        thread = get_ident()
        mark = self._marks.get(thread)
        if mark is None or duration_ns >= _SHORT_NS or monotonic_ns() >= mark.read_ns + _READ_NS:
            self._share(thread, thread_time_ns(), costs, duration_ns)
        else:
            mark.short.append((costs, duration_ns))

    def charge_running(self, costs: Costs, thread: int, native: int) -> None:
        """Add what a call has used so far that runs in another thread, which may have ended.

        Args:
            thread: Its identifier.
            native: Its number in the system.
        """
        used_ns = read_thread_clock_ns(native)
        if used_ns is not None:
            self._share(thread, used_ns, costs, _SHORT_NS)

    def _share(self, thread: int, used_ns: int, costs: Costs, duration_ns: int) -> None:
        # Taken away, so that of two who ask at once one gets nothing.
        mark = self._marks.pop(thread, None)
        self._marks[thread] = _Mark(used_ns)
        if mark is None:
            return
        left_ns = max(0, used_ns - mark.used_ns)
        total_ns = sum(each_ns for _, each_ns in mark.short)
        if duration_ns >= _SHORT_NS:
            # One that waits takes long, but uses nothing then.
            shared_ns = min(left_ns, total_ns)
            costs.cpu_ns += left_ns - shared_ns
        else:
            mark.short.append((costs, duration_ns))
            shared_ns, total_ns = left_ns, total_ns + duration_ns
        for each, each_ns in mark.short:
            each.cpu_ns += shared_ns * each_ns // max(1, total_ns)

    def take_waits(self) -> Waits | None:
        """Return how long others waited for the interpreter since this was last asked."""
        return None if self._waits is None else self._waits.take()


call_meter = CallMeter()
