"""The node of a system itself: `/diagnostics`, and services by which the system is asked.

It needs nothing of the executor of the system, so hanging behaviours stop neither. It is created
when the system is up, or takes long to come up, and so delays no start.

Tools that know containers, as `ros2 component list`, look for a node that is not hidden and has
all three services of one. The system has what its files say: to load and unload is refused.
Source: `find_container_node_names` in ros2cli (`ros2component/ros2component/api/__init__.py`).
"""

from __future__ import annotations

import itertools
import threading
from importlib.util import find_spec
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter

from composer.errors import StartError
from composer.runtime.control import protocol
from composer.runtime.control.answers import (
    describe_status,
    describe_top,
    status_answer,
    top_answer,
)
from composer.runtime.control.control_services import ControlServices
from composer.runtime.control.name_claim import NameClaim
from composer.runtime.control.protocol import container_name
from composer.runtime.health.diagnostics_publisher import CallWatcher, DiagnosticsPublisher
from composer.runtime.health.system_state import Outcome, find_log
from composer.runtime.logs import system_logger
from composer.runtime.system_executor import SystemExecutor

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rclpy.context import Context

    from composer.language.specs import SystemSpec
    from composer.runtime.control.control_services import Commands, ControlledSystem
    from composer.runtime.health.statistics import HealthRegistry

# The node is created then even if the system is not up.
_LATEST_SEC = 0.5
_STOP_SEC = 2.0
# How long an answer may take to whoever asked, before the node goes.
_ANSWER_SEC = 0.1
_REFUSAL = "the nodes of a system are those of its file: edit it, then 'composer reload {}'"


class ControlNode:
    """The node of a system itself, from `start` to `stop`.

    Args:
        health: The health of the system's entities.
        calls: Knows the calls that run.
        commands: `None` if the system is not to be asked over ROS.
        worker: The worker whose node this is; empty for the process of the system.
    """

    def __init__(
        self,
        system: ControlledSystem,
        spec: SystemSpec,
        health: HealthRegistry,
        calls: CallWatcher,
        commands: Commands | None,
        worker: str = '',
    ) -> None:
        self._worker = worker
        self._system = system
        self._commands = commands
        self._health = health
        self._calls = calls
        self._period_sec = spec.diagnostics_period_sec
        self._diagnostics: DiagnosticsPublisher | None = None
        self._services: ControlServices | None = None
        self._node: RosNode | None = None
        self._listing: ComponentListing | None = None
        self._executor: SystemExecutor | None = None
        self._claim: NameClaim | None = None
        # Held while the node and what it has are created or destroyed.
        self._lock = threading.Lock()
        self._may_begin = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name='composer-control', daemon=True)

    @property
    def ros(self) -> RosNode | None:
        """Its rclpy node; `None` while it needs none."""
        return self._node

    def start(self, context: Context, ros_arguments: Sequence[str]) -> None:
        """Take the system's name, and create the node soon.

        Args:
            ros_arguments: The arguments after `--ros-args` of the command line.

        Raises:
            StartError: Another system has the name.
        """
        self._context, self._ros_arguments = context, ros_arguments
        if self._worker:
            self._thread.start()
            return
        state = self._system.state
        self._claim = NameClaim(protocol.node_name(state.name), context.get_domain_id())
        about = {**state.who(), 'is_asked': self._commands is not None, 'log': find_log()}
        owner = self._claim.take(about)
        if owner is not None:
            advice = f"stop it with 'composer down {state.name}', or use another ROS_DOMAIN_ID"
            raise StartError(self._describe_rival(owner), help=advice)
        self._thread.start()

    def begin(self) -> None:
        """Create the node now, as the system is up."""
        self._may_begin.set()

    def follow(self, spec: SystemSpec) -> None:
        """Do from now on what a system says that was edited."""
        with self._lock:
            before, self._period_sec = self._period_sec, spec.diagnostics_period_sec
            if before is None:
                # What came until now is of no period.
                self._health.reports(1.0, (), 0)
            if self._may_begin.is_set():
                self._update()

    def stop(self) -> None:
        """Answer no more, and destroy the node, if it was created."""
        self._ended.set()
        self._may_begin.set()
        if self._thread.ident is not None:
            self._thread.join()
        self._stop_diagnostics()
        if self._executor is not None:
            self._executor.stop(_STOP_SEC)
            if self._services is not None:
                sleep(max(0.0, self._services.answered + _ANSWER_SEC - monotonic()))
        if self._listing is not None:
            self._listing.node.destroy_node()
        if self._node is not None:
            self._node.destroy_node()

    def release_name(self) -> None:
        """Let another system have the name, as this one has left the graph."""
        if self._claim is not None:
            self._claim.release()

    def _run(self) -> None:
        self._may_begin.wait(_LATEST_SEC)
        with self._lock:
            self._may_begin.set()
            self._update()

    def _update(self) -> None:
        """Have the node, and what belongs to it, if they are wanted."""
        if self._ended.is_set():
            return
        try:
            is_wanted = self._period_sec is not None or self._commands is not None
            if self._node is None and is_wanted:
                self._node = self._create_node()
            self._update_diagnostics()
            self._serve()
            if self._node is not None and not is_wanted:
                self._node.destroy_node()
                self._node = None
        except Exception as error:  # noqa: BLE001 - rclpy and the middleware raise many kinds
            system_logger.error(f'the system cannot be asked over ROS: {error}')

    def _create_node(self) -> RosNode:
        name = self._system.state.name
        return RosNode(
            protocol.node_name(f'{name}__{self._worker}' if self._worker else name),
            context=self._context,
            cli_args=['--ros-args', *self._ros_arguments],
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[
                Parameter('start_type_description_service', value=False),
                # Nothing that it does depends on `/clock`.
                Parameter('use_sim_time', value=False),
            ],
        )

    def _update_diagnostics(self) -> None:
        period_sec = self._period_sec
        if period_sec is None:
            self._stop_diagnostics()
        elif self._diagnostics is not None:
            self._diagnostics.change_period(period_sec)
        elif self._node is not None:
            diagnostics = DiagnosticsPublisher(
                self._system.state,
                period_sec,
                self._health,
                self._calls,
                self._system.find_deliveries,
                self._worker,
            )
            try:
                diagnostics.start(self._node)
            except ImportError as error:
                system_logger.warning(f'/diagnostics is not published: {error}')
            self._diagnostics = diagnostics

    def _stop_diagnostics(self) -> None:
        if self._diagnostics is not None:
            self._diagnostics.stop()
            self._diagnostics = None

    def _serve(self) -> None:
        if self._commands is None or self._node is None or self._executor is not None:
            return
        self._services = ControlServices(
            self._node, self._system, self._commands, self._status, self._top
        )
        self._executor = SystemExecutor(self._context, None, log=self._log)
        self._executor.add_node(self._node)
        # Its interface package is installed with ROS 2, or built for a system with containers.
        if find_spec('composition_interfaces') is not None:
            self._listing = ComponentListing(
                self._context, self._system.state.name, self._system.list_nodes
            )
            self._executor.add_node(self._listing.node)
        self._executor.start()

    def _log(self, text: str) -> None:
        # A command may still run at the stop, and nobody gets its answer.
        if not self._ended.is_set():
            system_logger.error(text)

    def describe_status(self) -> dict[str, Any]:
        """Return what this process says of itself, without its workers."""
        system = self._system
        return describe_status(
            system.state, system.list_nodes(), system.list_components(), self._diagnostics
        )

    def describe_top(self) -> dict[str, Any] | None:
        """Return the health of the entities of this process; `None` if nothing is measured."""
        if self._diagnostics is None:
            return None
        system = self._system
        ends = system.find_foreign_ends()
        return describe_top(system.state, self._diagnostics, system.find_deliveries(), ends)

    def _status(self) -> Outcome:
        workers = self._system.workers
        return status_answer(self.describe_status(), workers.ask('status'), workers.describe())

    def _top(self) -> Outcome:
        return top_answer(self.describe_top(), self._system.workers.ask('top'))

    def _describe_rival(self, rival: Mapping[str, Any]) -> str:
        what = f"a system '{self._system.state.name}' runs already on this ROS graph"
        known = [f'{key} {rival[key]}' for key in ('host', 'pid', 'file') if key in rival]
        domain = f'ROS_DOMAIN_ID {self._context.get_domain_id()}'
        return f'{what} ({", ".join([domain, *known])})'


class ComponentListing:
    """The node of a system that says which nodes are in its process.

    Args:
        list_nodes: Returns their full names.

    Attributes:
        node: The rclpy node.
    """

    def __init__(self, context: Context, system: str, list_nodes: Callable[[], list[str]]) -> None:
        from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode

        self._list_nodes = list_nodes
        self._refusal = _REFUSAL.format(system)
        self._numbers = itertools.count(1)
        self._ids: dict[str, int] = {}
        self.node = RosNode(
            container_name(system),
            context=context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter('start_type_description_service', value=False)],
        )
        for kind, name, answer in (
            (LoadNode, 'load_node', self._refuse),
            (UnloadNode, 'unload_node', self._refuse),
            (ListNodes, 'list_nodes', self._list),
        ):
            self.node.create_service(kind, f'~/_container/{name}', answer)

    def _refuse(self, _request: Any, response: Any) -> Any:
        response.success, response.error_message = False, self._refusal
        return response

    def _list(self, _request: Any, response: Any) -> Any:
        names = self._list_nodes()
        for name in names:
            if name not in self._ids:
                self._ids[name] = next(self._numbers)
        response.full_node_names = names
        response.unique_ids = [self._ids[name] for name in names]
        return response
