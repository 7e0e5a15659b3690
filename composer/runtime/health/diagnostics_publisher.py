"""`/diagnostics`: how every entity fares, for the diagnostic tools of ROS.

It comes from a thread and a node of its own, which need no executor: it goes on beside behaviours
that hang. The node's name begins with an underscore, which hides it from `ros2 node list`, as it
is none that the file declares; `ros2 node list --all` shows it.
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

    from composer.runtime.behaviours.calls import RunningCall
    from composer.runtime.health.statistics import HealthRegistry

# To write a message holds the interpreter: for a large system, one goes out for so many entities.
_MOST_STATUSES = 50
_DEPTH = 10
# ROS allows 255 (rmw/validate_node_name.h).
_LONGEST_NAME = 255


def node_name(system: str) -> str:
    """Return the name of the node that publishes the health of a system."""
    return f'_composer_{re.sub("[^A-Za-z0-9_]+", "_", system)}'[:_LONGEST_NAME]


class DiagnosticsPublisher:
    """Publishes a system's health while it is started.

    Args:
        system: The system's name.
        period_sec: Seconds between two messages.
        overdue: Returns the calls that run longer than they may, with their nodes' full names.
    """

    def __init__(
        self,
        system: str,
        period_sec: float,
        board: HealthRegistry,
        overdue: Callable[[], Iterable[tuple[str, RunningCall]]],
    ) -> None:
        self._system = system
        self._period_sec = period_sec
        self._board = board
        self._overdue = overdue
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._publish_on, name='diagnostics', daemon=True)

    def start(self, context: Context, ros_arguments: Sequence[str]) -> None:
        """Create the node and begin to publish.

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
                # Nobody spins the node, so it would never hear what time a simulation has.
                Parameter('use_sim_time', value=False),
            ],
        )
        self._publisher = self._node.create_publisher(DiagnosticArray, '/diagnostics', _DEPTH)
        self._thread.start()

    def stop(self) -> None:
        """Publish no more, and remove the node; also if it was never started."""
        self._ended.set()
        if self._thread.ident is not None:
            self._thread.join()
            self._node.destroy_node()

    def _publish_on(self) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        from composer.runtime.health.diagnostic_status import StatusWriter

        writers: dict[tuple[str, str], StatusWriter] = {}
        begun = monotonic()
        due = begun + self._period_sec
        while not self._ended.wait(max(0.0, due - monotonic())):
            now = monotonic()
            reports = self._board.reports(now - begun, self._overdue(), monotonic_ns())
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
