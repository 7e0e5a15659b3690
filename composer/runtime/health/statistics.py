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
from composer.runtime.health.call_times import CallTimes
from composer.runtime.health.missed import MissedCounts

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from composer.runtime.behaviours.running_calls import Owner, RunningCall

# The full name of a node, and an entity in it.
EntityKey: TypeAlias = 'tuple[str, Owner]'

_NONE_MISSED = MissedCounts()


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
        deliveries: How long messages were on their way to it; `None` if that was not measured.
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
    deliveries: CallTimes | None = None

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
        '_deliveries',
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
        self._deliveries: CallTimes | None = None
        self._past = self._missed = self._all_missed = _NONE_MISSED
        self._reported = 0, _NONE_MISSED
        self._rests = False

    def note_error(self, error: BaseException) -> None:
        """Count a call that raised."""
        self._errors += 1
        self._last_error = summarize(error)

    def follow(
        self,
        count_missed: Callable[[], MissedCounts],
        count_queued: Callable[[], int] = int,
        deliveries: CallTimes | None = None,
    ) -> None:
        """Ask here from now on what it has missed, because its node was created or restarted.

        Args:
            count_queued: Returns how many messages wait for it.
            deliveries: How long they were on their way, which is emptied with each report.
        """
        self._update_missed()
        self._past, self._missed = self._all_missed, _NONE_MISSED
        self._count_missed, self._count_queued = count_missed, count_queued
        self._deliveries = deliveries

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
            deliveries=self._deliveries and self._deliveries.take(),
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
