"""`/diagnostics`: the health of all entities, for the diagnostic tools of ROS.

It has a thread of its own and needs no executor, so hanging behaviours do not stop it.
"""

from __future__ import annotations

import threading
from time import monotonic, monotonic_ns
from typing import TYPE_CHECKING, Any

from composer.records import record
from composer.runtime.health.statistics import cpu_meter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from rclpy.node import Node as RosNode

    from composer.runtime.behaviours.running_calls import RunningCall
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
        has_cpu: Whether it was measured what calls cost the processor.
    """

    number: int
    has_cpu: bool
    by_entity: Mapping[EntityKey, EntityReport]


class DiagnosticsPublisher:
    """Publishes a system's health from `start` to `stop`.

    Args:
        state: The state of the system itself.
        period_sec: Seconds between two messages.
        overdue: Returns the calls that exceed their `warn_after`, with their nodes' full names.
        find_deliveries: Returns which way publishers and clients deliver.

    Attributes:
        latest: The health in the last period.
    """

    def __init__(
        self,
        state: SystemState,
        period_sec: float,
        registry: HealthRegistry,
        overdue: Callable[[], Iterable[tuple[str, RunningCall]]],
        find_deliveries: Callable[[], Deliveries],
    ) -> None:
        self._find_deliveries = find_deliveries
        self.latest = Reports(0, has_cpu=False, by_entity={})
        self.period_sec = period_sec
        self._state = state
        self._registry = registry
        self._overdue = overdue
        self._watched_until = 0.0
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
            cpu_meter.turn(on=False)
            self._node.destroy_publisher(self._publisher)

    def change_period(self, period_sec: float) -> None:
        """Let so many seconds be between two messages; a new period begins now."""
        if period_sec != self.period_sec:
            self.period_sec = period_sec
            self._woken.set()

    def watch(self) -> None:
        """Measure for some time what calls cost the processor, from the next period on."""
        self._watched_until = monotonic() + _WATCHED_SEC

    def _run(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        from composer.runtime.health.diagnostic_status import (
            StatusWriter,
            delivery_status,
            lifecycle_status,
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
            reports = self._registry.reports(now - begun, self._overdue(), monotonic_ns())
            begun = now
            self.latest = Reports(self.latest.number + 1, cpu_meter.is_on, reports)
            cpu_meter.turn(on=now < self._watched_until)
            due = max(due, now) + self.period_sec
            if not self._publisher.get_subscription_count():
                continue
            statuses = [system_status(self._node.get_fully_qualified_name(), self._state)]
            for key, report in reports.items():
                if key not in writers:
                    writers[key] = StatusWriter(*key, self._state.name)
                statuses.append(writers[key].write(report))
            statuses += [
                delivery_status(*key, each, self._state.name)
                for key, each in self._find_deliveries().items()
            ]
            statuses += [
                lifecycle_status(node, each, self._state.name)
                for node, each in self._state.find_lifecycles().items()
            ]
            stamp = self._node.get_clock().now().to_msg()
            for start in range(0, len(statuses), _MOST_STATUSES):
                message: Any = DiagnosticArray(status=statuses[start : start + _MOST_STATUSES])
                message.header.stamp = stamp
                self._publisher.publish(message)
