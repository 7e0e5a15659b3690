"""What entities missed because their callbacks did not begin in time."""

from dataclasses import dataclass

LATE_SHARE = 0.1
LATE_LEAST_NS = 1_000_000
"""A tick is late if it begins more than a tenth of its period, and more than 1 ms, after its time.

A thread that computes lets go of the interpreter once in `sys.getswitchinterval()`, 5 ms unless
that was set: beside it, timers with short periods are late indeed.
"""


@dataclass(frozen=True, slots=True)
class Missed:
    """Counts since the entity came to the executor.

    Attributes:
        overruns: Messages that the middleware dropped from the queue of a subscription, because
            newer ones came before they were taken. Not those lost on the way to the queue.
        late_ticks: Ticks of a timer that began late.
        skipped_ticks: Ticks that never were: rcl skips those whose time has passed.
    """

    overruns: int = 0
    late_ticks: int = 0
    skipped_ticks: int = 0

    def __add__(self, other: 'Missed') -> 'Missed':
        return Missed(
            self.overruns + other.overruns,
            self.late_ticks + other.late_ticks,
            self.skipped_ticks + other.skipped_ticks,
        )

    def __sub__(self, other: 'Missed') -> 'Missed':
        return Missed(
            self.overruns - other.overruns,
            self.late_ticks - other.late_ticks,
            self.skipped_ticks - other.skipped_ticks,
        )

    def __bool__(self) -> bool:
        return self != Missed()
