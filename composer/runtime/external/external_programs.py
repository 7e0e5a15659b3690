"""The external processes of a system, and what acts on them, wired together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.processes.supervisor import ProcessSupervisor
from composer.runtime.external.components import Components
from composer.runtime.external.exit_actions import ExitActions
from composer.runtime.lifecycle.driver import LifecycleDriver
from composer.runtime.logs import system_logger
from composer.runtime.start import Starter

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import SystemSpec
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.system_handle import SystemHandle


class ExternalPrograms:
    """External processes, the components of containers, and what drives lifecycles in both.

    Args:
        nodes: The nodes of this process, by their full names.
        end_system: Called with an exit code when a required process has ended, or the last of all.

    Attributes:
        processes: Runs the processes.
        components: Loads the components.
        starter: Starts the processes, and the nodes that wait for them or are waited for.
    """

    def __init__(
        self,
        spec: SystemSpec,
        system: SystemHandle,
        nodes: dict[str, LiveNode],
        end_system: Callable[[int], None],
    ) -> None:
        self.processes = ProcessSupervisor(
            spec.processes.values(),
            system_logger,
            end_system,
            spec.shutdown_timeout_sec,
            system.ros_arguments,
            system.log_levels,
        )
        self.components = Components(system)
        self.starter = Starter(nodes, self.processes, self.components, system)
        self._exits = ExitActions(self.processes, self.starter, system)
        self._driver = LifecycleDriver(
            system.context, system.executor, system.stop, self.processes
        )
        self.processes.on_restart = self.components.reload
        self.processes.on_exit = self._exits.act
        self.processes.on_run = self._driver.begin
        self.components.on_load = self._driver.begin_component

    def stop(self) -> tuple[bool, bool]:
        """End all processes.

        Returns:
            Whether none had to be killed, and whether all behaviours of `on_exit` have ended.
        """
        self.components.stop()
        none_killed = self.processes.stop()
        return none_killed, self._exits.report_hanging()

    def leave_graph(self) -> None:
        """Destroy the node that asks nodes with a lifecycle."""
        self._driver.close()
