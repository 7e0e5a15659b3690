"""What this process as a whole costs in a period."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from composer.records import record
from composer.runtime.costs.call_meter import call_meter

if TYPE_CHECKING:
    from composer.runtime.costs.interpreter_waits import Waits

_NS_PER_SEC = 1e9


@record
class ProcessCosts:
    """The costs of one period.

    Attributes:
        cores: How many processor cores it may use.
        cpu: How many processors the process used on average, with all of its threads.
        waits: How long callbacks waited for the interpreter; `None` if that was not measured.
    """

    cores: int
    cpu: float
    waits: Waits | None


class ProcessMeter:
    """Tells the costs of one period after the other."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Begin a period that is the first one in which calls are measured."""
        self._cpu_ns = time.process_time_ns()

    def take(self, period_sec: float) -> ProcessCosts:
        """Return the costs of the period that ends, and begin the next.

        Args:
            period_sec: How long it was.
        """
        before_ns, self._cpu_ns = self._cpu_ns, time.process_time_ns()
        return ProcessCosts(
            cores=len(os.sched_getaffinity(0)),
            cpu=(self._cpu_ns - before_ns) / _NS_PER_SEC / period_sec,
            waits=call_meter.take_waits(),
        )
