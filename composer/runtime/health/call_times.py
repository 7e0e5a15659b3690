"""How long calls, and messages on their way, took."""

from __future__ import annotations

from composer.runtime.costs.call_meter import call_meter

# Durations are sorted into 8 buckets for each power of two; none is narrower than 256 ns.
_UNIT_BITS = 8
_SUB_BITS = 3


class CallTimes:
    """How long calls took, each to within an eighth.

    Args:
        has_cpu: Whether they cost the processor anything.

    Attributes:
        counts: Calls by bucket; most entities use few of them.
        cpu_ns: What they cost the processor, while `call_meter` is on.
    """

    __slots__ = ('_has_cpu', 'counts', 'cpu_ns', 'most_ns', 'total_ns')

    def __init__(self, *, has_cpu: bool = True) -> None:
        self._has_cpu = has_cpu
        self.counts: dict[int, int] = {}
        self.cpu_ns = 0
        self.total_ns = 0
        self.most_ns = 0

    def add(self, duration_ns: int) -> None:
        """Count a call that has ended."""
        if call_meter.is_on and self._has_cpu:
            call_meter.charge(self, duration_ns)
        units = duration_ns >> _UNIT_BITS
        shift = units.bit_length() - _SUB_BITS - 1
        bucket = (shift << _SUB_BITS) + (units >> shift) if shift > 0 else units
        # Nothing is called from here on.
        counts = self.counts
        if bucket in counts:
            counts[bucket] += 1
        else:
            counts[bucket] = 1
        self.total_ns += duration_ns
        if duration_ns > self.most_ns:  # noqa: PLR1730 - `max` would be a call
            self.most_ns = duration_ns

    def take(self) -> CallTimes:
        """Return all counts so far, and start again with none."""
        taken = CallTimes()
        # Nothing is called from here on.
        taken.counts, self.counts = self.counts, taken.counts
        taken.cpu_ns, self.cpu_ns = self.cpu_ns, 0
        taken.total_ns, self.total_ns = self.total_ns, 0
        taken.most_ns, self.most_ns = self.most_ns, 0
        return taken

    def calls(self) -> int:
        """Return the number of calls."""
        return sum(self.counts.values())

    def mean_ns(self) -> float:
        """Return the mean duration; 0 if there were no calls."""
        return self.total_ns / (self.calls() or 1)

    def percentile_ns(self, share: float) -> int:
        """Return the duration that this share of the calls kept to, up to an eighth too high.

        Args:
            share: More than 0, as in 0.99.
        """
        left = share * self.calls()
        for bucket in sorted(self.counts):
            left -= self.counts[bucket]
            if left <= 0:
                return min(_last_ns(bucket), self.most_ns)
        return self.most_ns


def _last_ns(bucket: int) -> int:
    """Return the longest duration of a bucket."""
    shift = max((bucket >> _SUB_BITS) - 1, 0)
    return ((bucket - (shift << _SUB_BITS) + 1) << shift << _UNIT_BITS) - 1
