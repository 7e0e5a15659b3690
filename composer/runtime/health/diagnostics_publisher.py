"""`/diagnostics`: the health of all entities, for the diagnostic tools of ROS.

It has a thread of its own and needs no executor, so hanging behaviours do not stop it.
"""

from __future__ import annotations

import threading
from time import monotonic, monotonic_ns
from typing import TYPE_CHECKING, Any, Protocol

from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from composer.records import record
from composer.runtime.costs.call_meter import call_meter
from composer.runtime.costs.process_costs import ProcessMeter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rclpy.node import Node as RosNode

    from composer.runtime.behaviours.running_calls import RunningCall
    from composer.runtime.costs.process_costs import ProcessCosts
    from composer.runtime.health.deliveries import Deliveries
    from composer.runtime.health.statistics import EntityKey, EntityReport, HealthRegistry
    from composer.runtime.health.system_state import SystemState

# Writing a message holds the interpreter's lock: large systems send several smaller ones.
_MOST_STATUSES = 50
_DEPTH = 10
# What calls cost the processor is measured for so long after somebody asked.
_WATCHED_SEC = 10.0


@record
class Reports:
    """The health of all entities in one period.

    Attributes:
        number: Counts the periods.
        costs: Those of the process; `None` if it was not measured what calls cost.
        rates: How often publishers and clients sent in a second, if that was measured.
    """

    number: int
    costs: ProcessCosts | None
    by_entity: Mapping[EntityKey, EntityReport]
    rates: Mapping[EntityKey, float]


class CallWatcher(Protocol):
    """Knows the calls that run."""

    def overdue_calls(self) -> Iterable[tuple[str, RunningCall]]:
        """Return the calls that exceed their `warn_after`, with their nodes' full names."""

    def running_calls(self) -> Iterable[tuple[str, RunningCall]]:
        """Return all calls, with their nodes' full names."""


class DiagnosticsPublisher:
    """Publishes a system's health from `start` to `stop`.

    Args:
        state: The state of the system itself.
        period_sec: Seconds between two messages.
        find_deliveries: Returns which way publishers and clients deliver.
        worker: The worker whose process this is; empty for that of the system.

    Attributes:
        latest: The health in the last period.
    """

    def __init__(
        self,
        state: SystemState,
        period_sec: float,
        registry: HealthRegistry,
        calls: CallWatcher,
        find_deliveries: Callable[[], Deliveries],
        worker: str = '',
    ) -> None:
        self._worker = worker
        self._find_deliveries = find_deliveries
        self.latest = Reports(0, None, {}, {})
        self.period_sec = period_sec
        self._state = state
        self._registry = registry
        self._calls = calls
        self._meter = ProcessMeter()
        self._watched_until = 0.0
        self._sent: dict[EntityKey, int] = {}
        self._has_ended = False
        self._woken = threading.Event()
        self._thread = threading.Thread(target=self._run, name='diagnostics', daemon=True)

    def start(self, node: RosNode) -> None:
        """Start to publish.

        Raises:
            ImportError: The messages of diagnostics are not installed.
        """
        from diagnostic_msgs.msg import DiagnosticArray

        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', _DEPTH)
        self._thread.start()

    def stop(self) -> None:
        """Stop to publish."""
        self._has_ended = True
        self._woken.set()
        if self._thread.ident is not None:
            self._thread.join()
            call_meter.turn(on=False)
            self._node.destroy_publisher(self._publisher)

    def change_period(self, period_sec: float) -> None:
        """Let so many seconds be between two messages; a new period begins now."""
        if period_sec != self.period_sec:
            self.period_sec = period_sec
            self._woken.set()

    def watch(self) -> None:
        """Measure for some time what calls cost, from the next period on."""
        self._watched_until = monotonic() + _WATCHED_SEC

    def _run(self) -> None:
        try:
            self._publish_on()
        except (InvalidHandle, _rclpy.RCLError):
            # A behaviour may have shut ROS down: the system ends then.
            if self._node.context.ok():
                raise

    def _publish_on(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        from composer.runtime.health.diagnostic_status import (
            StatusWriter,
            delivery_status,
            lifecycle_status,
            process_status,
            system_status,
        )

        writers: dict[EntityKey, StatusWriter] = {}
        begun = monotonic()
        due = begun + self.period_sec
        while not self._has_ended:
            if self._woken.wait(max(0.0, due - monotonic())):
                self._woken.clear()
                due = monotonic() + self.period_sec
                continue
            now = monotonic()
            is_heard = bool(self._publisher.get_subscription_count())
            is_watched = is_heard or now < self._watched_until
            deliveries = self._find_deliveries() if is_watched else {}
            latest = self.latest = self._take_reports(now - begun, deliveries)
            begun = now
            due = max(due, now) + self.period_sec
            self._measure_calls(on=is_watched)
            if not is_heard:
                continue
            name = self._node.get_fully_qualified_name()
            statuses = [system_status(name, self._state, latest.costs)]
            for key, report in latest.by_entity.items():
                if key not in writers:
                    writers[key] = StatusWriter(*key, self._state.name, self._worker)
                statuses.append(writers[key].write(report))
            statuses += [
                delivery_status(*key, each, self._state.name, latest.rates.get(key))
                for key, each in deliveries.items()
            ]
            statuses += [
                lifecycle_status(node, each, self._state.name)
                for node, each in self._state.find_lifecycles().items()
            ]
            statuses += [
                process_status(name, each, self._state.name)
                for each in self._state.find_processes()
            ]
            stamp = self._node.get_clock().now().to_msg()
            for start in range(0, len(statuses), _MOST_STATUSES):
                message: Any = DiagnosticArray(status=statuses[start : start + _MOST_STATUSES])
                message.header.stamp = stamp
                self._publisher.publish(message)

    def _take_reports(self, period_sec: float, deliveries: Deliveries) -> Reports:
        """Return the health in the period that ends."""
        costs = None
        if call_meter.is_on:
            self._registry.add_costs(self._calls.running_calls())
            costs = self._meter.take(period_sec)
        reports = self._registry.reports(
            period_sec,
            self._calls.overdue_calls(),
            monotonic_ns(),
            is_measured=costs is not None,
        )
        before, self._sent = self._sent, {key: each.count for key, each in deliveries.items()}
        rates = {
            # One that was created again counts from 0.
            key: (count - before[key] if count >= before[key] else count) / period_sec
            for key, count in self._sent.items()
            if key in before
        }
        return Reports(self.latest.number + 1, costs, reports, rates)

    def _measure_calls(self, *, on: bool) -> None:
        if on and not call_meter.is_on:
            self._meter.begin()
        call_meter.turn(on=on)
