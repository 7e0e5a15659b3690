"""`/diagnostics`: the health of all entities, for the diagnostic tools of ROS.

It has a thread and a node of its own and needs no executor, so hanging behaviours do not stop it.
The file does not declare this node, so its name begins with an underscore, which hides it from
`ros2 node list`; `ros2 node list --all` shows it.
"""

from __future__ import annotations

import re
import threading
from time import monotonic, monotonic_ns
from typing import TYPE_CHECKING, Any

from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from rclpy.context import Context

    from composer.runtime.behaviours.running_calls import RunningCall
    from composer.runtime.health.statistics import EntityKey, HealthRegistry

# Writing a message holds the interpreter's lock: large systems send several smaller ones.
_MOST_STATUSES = 50
_DEPTH = 10
# ROS allows 255 (rmw/validate_node_name.h).
_LONGEST_NAME = 255


def node_name(system: str) -> str:
    """Return the name of the node that publishes the health of a system."""
    return f'_composer_{re.sub("[^A-Za-z0-9_]+", "_", system)}'[:_LONGEST_NAME]


class DiagnosticsPublisher:
    """Publishes a system's health from `start` to `stop`.

    Args:
        system: The system's name.
        period_sec: Seconds between two messages.
        overdue: Returns the calls that exceed their `warn_after`, with their nodes' full names.
    """

    def __init__(
        self,
        system: str,
        period_sec: float,
        registry: HealthRegistry,
        overdue: Callable[[], Iterable[tuple[str, RunningCall]]],
    ) -> None:
        self._system = system
        self._period_sec = period_sec
        self._registry = registry
        self._overdue = overdue
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name='diagnostics', daemon=True)

    def start(self, context: Context, ros_arguments: Sequence[str]) -> None:
        """Create the node and start to publish.

        Args:
            ros_arguments: The arguments after `--ros-args` of the command line.
        """
        from diagnostic_msgs.msg import DiagnosticArray

        self._node = RosNode(
            node_name(self._system),
            context=context,
            cli_args=['--ros-args', *ros_arguments],
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[
                Parameter('start_type_description_service', value=False),
                # Nothing spins the node, so it would never receive `/clock`.
                Parameter('use_sim_time', value=False),
            ],
        )
        self._publisher = self._node.create_publisher(DiagnosticArray, '/diagnostics', _DEPTH)
        self._thread.start()

    def stop(self) -> None:
        """Stop to publish and destroy the node, if it was started."""
        self._ended.set()
        if self._thread.ident is not None:
            self._thread.join()
            self._node.destroy_node()

    def _run(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        from composer.runtime.health.diagnostic_status import StatusWriter

        writers: dict[EntityKey, StatusWriter] = {}
        begun = monotonic()
        due = begun + self._period_sec
        while not self._ended.wait(max(0.0, due - monotonic())):
            now = monotonic()
            reports = self._registry.reports(now - begun, self._overdue(), monotonic_ns())
            begun = now
            due = max(due, now) + self._period_sec
            if not self._publisher.get_subscription_count():
                continue
            statuses = []
            for key, report in reports.items():
                if key not in writers:
                    writers[key] = StatusWriter(*key, self._system)
                statuses.append(writers[key].write(report))
            stamp = self._node.get_clock().now().to_msg()
            for start in range(0, len(statuses), _MOST_STATUSES):
                message: Any = DiagnosticArray(status=statuses[start : start + _MOST_STATUSES])
                message.header.stamp = stamp
                self._publisher.publish(message)
