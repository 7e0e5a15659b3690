"""What the nodes of a system share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rclpy.context import Context

    from composer.language.specs import OnError, QosSpec
    from composer.runtime.behaviours.failures import ServiceFailures
    from composer.runtime.behaviours.waiting import StopSignal
    from composer.runtime.health.statistics import HealthBoard
    from composer.runtime.system_executor import SystemExecutor
    from composer.yaml_text.positions import SourceMap


@dataclass(frozen=True, slots=True)
class SystemServices:
    """What nodes need of the system that they are part of.

    Attributes:
        functions: The behaviours, by their names.
        ros_arguments: The arguments after `--ros-args` of the command line.
        act_on_error: Takes a node's full name and what to do after an error in it.
        shutdown: Ends the system with an exit code.
        executor: Runs the callbacks of all nodes.
        stop: Whether the system is to stop.
        failures: Which services failed lately.
        without_parameter_services: The full names of the nodes that have none.
        health: How the entities of the system fare; `None` measures nothing.
    """

    context: Context
    positions: SourceMap
    profiles: Mapping[str, QosSpec]
    functions: Mapping[str, Callable[..., Any]]
    ros_arguments: Sequence[str]
    act_on_error: Callable[[str, OnError], None]
    shutdown: Callable[[int], None]
    executor: SystemExecutor
    stop: StopSignal
    failures: ServiceFailures
    without_parameter_services: frozenset[str]
    health: HealthBoard | None
