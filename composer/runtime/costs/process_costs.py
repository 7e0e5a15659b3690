"""What this process as a whole costs in a period, and how busy its interpreter is."""

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
        sampled_ns: How long it was sampled who holds the interpreter; 0 if that cannot be known.
        awaits_samples: Whether there was no sample in time, and a later period may have some: the
            sampler has just begun, or processors are scarce.
        held: The share of that time in which somebody held it; `None` if that cannot be known.
        waits: How long others waited for it; `None` if that was not measured.
    """

    cores: int
    cpu: float
    sampled_ns: int
    awaits_samples: bool
    held: float | None
    waits: Waits | None


class ProcessMeter:
    """Tells the costs of one period after the other."""

    def __init__(self) -> None:
        self._cpu_ns = time.process_time_ns()
        self._sampled_ns = self._held_ns = 0

    def begin(self) -> None:
        """Begin a period that is the first one in which calls are measured."""
        self._cpu_ns = time.process_time_ns()
        self._sampled_ns = self._held_ns = 0

    def take(self, period_sec: float) -> ProcessCosts:
        """Return the costs of the period that ends, and begin the next.

        Args:
            period_sec: How long it was.
        """
        before_ns, self._cpu_ns = self._cpu_ns, time.process_time_ns()
        all_sampled = call_meter.sampled()
        sampled_ns = all_sampled.elapsed_ns - self._sampled_ns
        held_ns = all_sampled.held_ns - self._held_ns
        self._sampled_ns, self._held_ns = all_sampled.elapsed_ns, all_sampled.held_ns
        return ProcessCosts(
            cores=len(os.sched_getaffinity(0)),
            cpu=(self._cpu_ns - before_ns) / _NS_PER_SEC / period_sec,
            sampled_ns=sampled_ns,
            awaits_samples=not sampled_ns and call_meter.is_sampling,
            held=min(1.0, held_ns / sampled_ns) if sampled_ns else None,
            waits=call_meter.take_waits(),
        )
