"""Delays that double: what fails again and again is tried, or reported, ever more rarely."""

from __future__ import annotations

from dataclasses import dataclass
from time import monotonic

# Of restarts: what ran for a minute has recovered.
_FIRST_RESTART_SEC = 0.1
_LONGEST_RESTART_SEC = 30.0
_RECOVERED_SEC = 60.0


@dataclass(slots=True)
class Backoff:
    """How long to wait before the next attempt; by default, before the next restart.

    Attributes:
        first_sec: The first delay; each further one is twice as long.
        longest_sec: No delay gets longer.
        least_sec: No delay is shorter.
        recovered_sec: After this time without an attempt, the delays begin anew.
    """

    first_sec: float = _FIRST_RESTART_SEC
    longest_sec: float = _LONGEST_RESTART_SEC
    least_sec: float = 0.0
    recovered_sec: float = _RECOVERED_SEC
    _doubled_sec: float = 0.0
    _attempt: float = float('-inf')

    def next_delay_sec(self) -> float:
        """Return the delay before the attempt that is due now."""
        now = monotonic()
        if not self._doubled_sec or now - self._attempt > self.recovered_sec:
            self._doubled_sec = self.first_sec
        delay_sec = max(self._doubled_sec, self.least_sec)
        self._doubled_sec = min(self._doubled_sec * 2, self.longest_sec)
        self._attempt = now + delay_sec
        return delay_sec
