"""The health of a system by entity: calls, errors, durations, and what the entity missed.

Noting a call takes half a microsecond, two clock reads included. There is no lock: nothing is
called while numbers change, and CPython switches threads only at calls and backward jumps. Should
that ever fail, one call is not counted.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, TypeAlias

from composer.records import record
from composer.runtime.behaviours.tracebacks import summarize
from composer.runtime.costs.call_meter import call_meter
from composer.runtime.health.missed import MissedCounts

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from composer.runtime.behaviours.running_calls import Owner, RunningCall

# Durations are sorted into 8 buckets for each power of two; none is narrower than 256 ns.
_UNIT_BITS = 8
_SUB_BITS = 3

# The full name of a node, and an entity in it.
EntityKey: TypeAlias = 'tuple[str, Owner]'

_NONE_MISSED = MissedCounts()


class CallTimes:
    """How long calls took, each to within an eighth.

    Attributes:
        counts: Calls by bucket; most entities use few of them.
        cpu_ns: What they cost the processor, while `call_meter` is on.
    """

    __slots__ = ('counts', 'cpu_ns', 'most_ns', 'total_ns')

    def __init__(self) -> None:
        self.counts: dict[int, int] = {}
        self.cpu_ns = 0
        self.total_ns = 0
        self.most_ns = 0

    def add(self, duration_ns: int) -> None:
        """Count a call that has ended."""
        if call_meter.is_on:
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


@record
class EntityReport:
    """The health of an entity in one period, and since the start.

    Attributes:
        period_sec: How long the period was.
        times: Those of the calls that ended in the period.
        errors: How many calls raised in the period.
        last_error: The last of these errors, empty if there was none.
        missed: What it missed in the period.
        overdue_sec: How long a call has been running that exceeds `warn_after`; 0 if none does.
        queued: How many messages wait for it.
        all_calls: Since the start, as the next two.
        is_measured: Whether the processor time of its calls was measured.
    """

    period_sec: float
    times: CallTimes
    errors: int
    last_error: str
    missed: MissedCounts
    overdue_sec: float
    queued: int
    all_calls: int
    all_errors: int
    all_missed: MissedCounts
    is_measured: bool = False

    @property
    def cpu(self) -> float | None:
        """The share of a processor that its calls used; `None` if it was not measured."""
        return self.times.cpu_ns / 1e9 / self.period_sec if self.is_measured else None


class EntityHealth:
    """The health of one entity; it outlives restarts of the entity's node.

    Attributes:
        times: The durations of the present period.
    """

    __slots__ = (
        '_all_missed',
        '_calls',
        '_count_missed',
        '_count_queued',
        '_errors',
        '_last_error',
        '_missed',
        '_past',
        '_reported',
        '_rests',
        'times',
    )

    def __init__(self) -> None:
        self.times = CallTimes()
        self._calls = 0
        self._errors = 0
        self._last_error = ''
        self._count_missed: Callable[[], MissedCounts] = MissedCounts
        self._count_queued: Callable[[], int] = int
        self._past = self._missed = self._all_missed = _NONE_MISSED
        self._reported = 0, _NONE_MISSED
        self._rests = False

    def note_error(self, error: BaseException) -> None:
        """Count a call that raised."""
        self._errors += 1
        self._last_error = summarize(error)

    def follow(
        self, count_missed: Callable[[], MissedCounts], count_queued: Callable[[], int] = int
    ) -> None:
        """Ask here from now on what it has missed, because its node was created or restarted.

        Args:
            count_queued: Returns how many messages wait for it.
        """
        self._update_missed()
        self._past, self._missed = self._all_missed, _NONE_MISSED
        self._count_missed, self._count_queued = count_missed, count_queued

    def rest(self, *, rests: bool) -> None:
        """Do not count what it misses from now on, as it is told to; or count it again."""
        self._update_missed()
        self._rests = rests

    def report(
        self, period_sec: float, overdue_sec: float, *, is_measured: bool = False
    ) -> EntityReport:
        """Return the health of the period that ends, and begin a new one.

        Args:
            period_sec: How long the period was.
            overdue_sec: How long a call has been running that exceeds `warn_after`.
            is_measured: See `EntityReport`.
        """
        times = self.times.take()
        self._calls += times.calls()
        self._update_missed()
        errors, missed = self._errors, self._all_missed
        reported_errors, reported_missed = self._reported
        self._reported = errors, missed
        return EntityReport(
            period_sec=period_sec,
            times=times,
            errors=errors - reported_errors,
            last_error=self._last_error if errors > reported_errors else '',
            missed=_NONE_MISSED if missed is reported_missed else missed - reported_missed,
            overdue_sec=overdue_sec,
            queued=self._count_queued(),
            all_calls=self._calls,
            all_errors=errors,
            all_missed=missed,
            is_measured=is_measured,
        )

    def _update_missed(self) -> None:
        missed = self._count_missed()
        # After the entity was destroyed, nothing is known of it.
        if missed and missed != self._missed:
            self._missed = missed
            if self._rests:
                self._past = self._all_missed - missed
            self._all_missed = self._past + missed


class HealthRegistry:
    """The health of all entities of a system that have behaviours."""

    def __init__(self) -> None:
        self._entities: dict[EntityKey, EntityHealth] = {}

    def entity(self, node: str, owner: Owner) -> EntityHealth:
        """Return the health of an entity, the same one whenever its node is built.

        Args:
            node: The node's full name.
        """
        return self._entities.setdefault((node, owner), EntityHealth())

    def keep(self, owners: Mapping[str, Collection[Owner]]) -> None:
        """Forget entities that are gone.

        Args:
            owners: Whose behaviours are still there, by the full names of their nodes.
        """
        for node, owner in list(self._entities):
            if owner not in owners.get(node, ()):
                del self._entities[node, owner]

    def add_costs(self, running: Iterable[tuple[str, RunningCall]]) -> None:
        """Count what calls have cost that run on, which would else count when they end.

        Args:
            running: The calls, with the full names of their nodes.
        """
        natives = {each.ident: each.native_id for each in threading.enumerate()}
        for node, call in running:
            native = natives.get(call.thread)
            entity = self._entities.get((node, call.owner))
            if call.thread is not None and native is not None and entity is not None:
                call_meter.charge_running(entity.times, call.thread, native)

    def reports(
        self,
        period_sec: float,
        overdue: Iterable[tuple[str, RunningCall]],
        now_ns: int,
        *,
        is_measured: bool = False,
    ) -> dict[EntityKey, EntityReport]:
        """Return the health of all entities in the period that ends, and begin a new one.

        Args:
            period_sec: How long the period was.
            overdue: The calls that exceed `warn_after`, with the full names of their nodes.
            now_ns: The present time of `time.monotonic_ns`.
            is_measured: See `EntityReport`.
        """
        longest: dict[EntityKey, float] = {}
        for node, call in overdue:
            key = node, call.owner
            longest[key] = max(longest.get(key, 0.0), (now_ns - call.since_ns) / 1e9)
        return {
            key: entity.report(period_sec, longest.get(key, 0.0), is_measured=is_measured)
            for key, entity in self._entities.copy().items()
        }
