"""`SystemSpec` → a running system: all of it starts or nothing, and all of it stops cleanly."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from composer.errors import ExitCode
from composer.planning.differences import compare
from composer.processes.guardian_client import end_marked
from composer.processes.supervisor import ProcessSupervisor
from composer.runtime.behaviours.running_calls import describe_last_calls
from composer.runtime.behaviours.tracebacks import format_internal_error
from composer.runtime.control.control_node import ControlNode
from composer.runtime.entities.creators import create_entity
from composer.runtime.external.components import Components
from composer.runtime.external.exit_actions import ExitActions
from composer.runtime.health.deliveries import find_deliveries
from composer.runtime.health.hangs import HangWatcher
from composer.runtime.health.introductions import Introductions
from composer.runtime.health.other_hosts import OtherHosts
from composer.runtime.health.statistics import HealthRegistry
from composer.runtime.health.system_state import Outcome, SystemState
from composer.runtime.health.unmatched import GraphWatcher
from composer.runtime.hold import wait_until_let_go
from composer.runtime.lifecycle.driver import LifecycleDriver
from composer.runtime.logs import is_output_unread, system_logger
from composer.runtime.messages.local_delivery import LocalTopics
from composer.runtime.messages.local_services import LocalServices
from composer.runtime.middleware.ros_context import create_ros_context, leave_graph_at_exit
from composer.runtime.nodes.parameter_services import ParameterServiceStarter
from composer.runtime.nodes.system_handle import ServiceFailures, SystemHandle
from composer.runtime.reserved_methods import release, reserve
from composer.runtime.restart import ErrorPolicy, NodeRestarter
from composer.runtime.rewiring.edit import Edit
from composer.runtime.rewiring.goals_in_flight import wait_for_goals
from composer.runtime.rewiring.rewire import Rewiring
from composer.runtime.start import Starter
from composer.runtime.stop import limit_stop, stop_nodes
from composer.runtime.stop_request import StopRequest
from composer.runtime.system_executor import SystemExecutor
from composer.runtime.wait_for import find_hidden
from composer.runtime.workers.worker_parts import find_moved
from composer.runtime.workers.workers import no_workers

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from rclpy.context import Context
    from rclpy.node import Node as RosNode

    from composer.language.specs import SystemSpec
    from composer.planning.plan import Plan
    from composer.planning.snapshot import Snapshot
    from composer.processes.external_process import ExternalProcess
    from composer.processes.guardian_client import GuardianClient, NoGuardian
    from composer.runtime.control.control_services import Commands
    from composer.runtime.health.deliveries import Deliveries
    from composer.runtime.health.unmatched import GraphObserver
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.workers.workers import Workers

_EXECUTOR_STOP_SEC = 1.0


class SystemRecorder(Protocol):
    """Records the topics of a system."""

    def start(self, context: Context, topics: LocalTopics) -> None:
        """Begin, before there are nodes."""

    def stop(self, *, goes_on: bool) -> None:
        """End, when all nodes have stopped; `goes_on` if the system starts again."""


class System:
    """A system that can be started once and stopped once.

    Args:
        reading: What it runs as.
        guardian: Ends the process if the stop takes too long. If it owns the process, that exits
            after the stop, and nothing uses ROS then.
        ros_arguments: The arguments after `--ros-args` of the command line.
        log_levels: The log levels of the command line.
        stop_request: The request to stop it; by default a new one.
        commands: What it does with its files when it is asked; `None` if it is not to be asked.
        recorder: Records its topics; `None` if nothing does.
        workers: Run the nodes that are in workers; `None` if all run in this process.

    Attributes:
        hold: While this file is there, no behaviour starts; `None` for no such file.
        has_ended: Whether everything has ended. If not, behaviours still run after `stop`, and
            only the end of this process ends them.
        state: What it says of itself.
        label: What it is called in the log.
    """

    label = 'the system'

    def __init__(  # noqa: PLR0913 - one for each part
        self,
        reading: Reading,
        guardian: GuardianClient | NoGuardian,
        ros_arguments: Sequence[str] = (),
        log_levels: Sequence[str] = (),
        *,
        stop_request: StopRequest | None = None,
        commands: Commands | None = None,
        recorder: SystemRecorder | None = None,
        workers: Workers | None = None,
    ) -> None:
        self._recorder = recorder
        self.workers = workers or no_workers()
        self.hold: Path | None = None
        # What is told of the system, and what this process runs of it.
        self._whole, self._reading = reading, self.workers.own_part(reading)
        spec = self._reading.spec
        self._prompt: list[LiveNode] = []
        self.state = SystemState(system_title(spec), reading.positions.source.name)
        self._guardian = guardian
        self.has_ended = False
        self._stop_request = stop_request or StopRequest()
        self._nodes: dict[str, LiveNode] = {}
        self._context = create_ros_context(ros_arguments)
        self._executor = self._create_executor(
            log=system_logger.error,
            on_lost=partial(
                self._stop_request.fail, 'the ROS context was shut down, so the system ends'
            ),
            on_broken=self._on_broken,
        )
        reserve(self._executor, 'the executor', 'shutdown')
        self._hang_watcher = HangWatcher(self._nodes, spec, self._executor.errors)
        self._graph_watcher = GraphWatcher(
            lambda: [end for node in list(self._nodes.values()) for end in node.endpoints],
            self._find_graph_node,
            self._create_observers(),
        )
        self._error_policy = ErrorPolicy(self.restart_node, self.shutdown)
        self._handle = self._create_handle(ros_arguments, log_levels)
        self._processes = ProcessSupervisor(
            spec.processes.values(),
            system_logger,
            self._end,
            spec.shutdown_timeout_sec,
            ros_arguments,
            log_levels,
        )
        self._processes.is_alone = not reading.spec.nodes
        self._stop_request.kill_processes = self._kill_processes
        self._components = Components(self._handle)
        self._processes.on_restart = self._components.reload
        self.state.find_lifecycles = self._find_lifecycles
        self._starter = Starter(self._nodes, self._processes, self._components, self._handle)
        self._exits = ExitActions(self._processes, self._starter, self._handle)
        self._processes.on_exit = self._exits.act
        self._driver = LifecycleDriver(
            self._context, self._executor, self._stop_request, self._processes
        )
        self._processes.on_run = self._driver.begin
        self._components.on_load = self._driver.begin_component
        self._restarter = NodeRestarter(self._nodes, self._starter, self._handle)
        self._parameter_services = ParameterServiceStarter(self._nodes, self._restarter.lock)
        self._control = self._create_control(commands)
        self.workers.bind(self, reading)

    def _find_graph_node(self) -> RosNode | None:
        return next((node.ros for node in list(self._nodes.values())), self._control.ros)

    def _create_observers(self) -> list[GraphObserver]:
        return [Introductions(), OtherHosts(lambda: self._whole.spec)]

    def _create_control(self, commands: Commands | None) -> ControlNode:
        return ControlNode(
            self,
            self._reading.spec,
            self._handle.health,
            self._hang_watcher,
            commands,
        )

    @property
    def _most_threads(self) -> int | None:
        """How many callbacks may run at a time; `None` for as many as block."""
        return self._reading.spec.threads

    def _kill_processes(self) -> None:
        self.workers.kill_all()
        self._processes.kill_all()

    def shutdown(self, code: int) -> None:
        """End the whole system, because one of its nodes asks for that."""
        self._stop_request.make(code)

    def _create_executor(self, **calls: Any) -> SystemExecutor:
        """Return what runs the callbacks.

        Args:
            calls: Arguments of `SystemExecutor`: what it calls.
        """
        return SystemExecutor(self._context, self._most_threads, **calls)

    def _create_handle(
        self, ros_arguments: Sequence[str], log_levels: Sequence[str]
    ) -> SystemHandle:
        spec = self._reading.spec
        return SystemHandle(
            context=self._context,
            positions=self._reading.positions,
            profiles=spec.qos,
            functions=self._reading.functions,
            parameter_files=self._reading.snapshot.overrides,
            ros_arguments=ros_arguments,
            log_levels=log_levels,
            act_on_error=self._error_policy.act,
            shutdown=self.shutdown,
            executor=self._executor,
            stop=self._stop_request,
            failures=ServiceFailures(),
            without_parameter_services=spec.without_parameter_services,
            stop_timeout_sec=spec.shutdown_timeout_sec,
            health=HealthRegistry(),
            topics=LocalTopics(self._executor),
            services=LocalServices(self._executor),
            elsewhere=self,
            create_entity=create_entity,
        )

    @property
    def stop_requested(self) -> bool:
        """Whether a stop was requested."""
        return self._stop_request.is_set

    def request_stop(self, code: int = ExitCode.DONE) -> None:
        """Let `wait` return; a signal handler may call it.

        Args:
            code: The exit code; the first one that is not 0 counts.
        """
        self._stop_request.make(code)

    def start(self) -> None:
        """Create all nodes and entities, run `on_start`, then let the behaviours run.

        No `on_start` runs before all nodes are created, those in workers, too. External processes
        start before any `on_start`. What has a `wait_for` or a `delay` starts last, while
        the behaviours of all others run. If a node cannot start, the `on_stop` of those that
        have started is run.

        Raises:
            StartError: Something could not start; all the rest has been stopped again.
        """
        together = self.workers.together
        try:
            with together('create'):
                self.create()
            if self.hold is not None:
                wait_until_let_go(self.hold, lambda: self.stop_requested)
                if self.stop_requested:
                    return
            with together('run_on_start') as wait_elsewhere:
                waits = self.run_on_start()
            if (waits or any(wait_elsewhere)) and not self.stop_requested:
                with together('open'):
                    self.open()
                with together('start_waiting'):
                    self.start_waiting()
            if not self.stop_requested:
                self.workers.keep_up(self._whole.spec)
        except BaseException:
            self.stop()
            raise
        if self.stop_requested:
            return
        # Who reads the line may stop the system at once.
        self._stop_request.system_is_up = True
        self._tell_start()
        self.workers.be_up()
        self.be_up()

    def create(self) -> None:
        """Create all nodes and entities of this process; no behaviour is called yet.

        Raises:
            StartError: One of them cannot be created.
        """
        self._control.start(self._context, self._handle.ros_arguments)
        if self._recorder is not None:
            self._recorder.start(self._context, self._handle.topics)
        self._create_nodes()
        self._executor.start()
        self._hang_watcher.start()
        self._graph_watcher.start()
        self._parameter_services.start()
        for node in self._nodes.values():
            node.serve_at_once()
        self._executor.wake()

    def run_on_start(self) -> bool:
        """Start processes and nodes that wait for nothing; return whether others wait.

        Raises:
            StartError: One of them could not start.
        """
        processes = self._processes.by_name.values()
        self._prompt = self._starter.start_prompt(self._nodes.values(), processes)
        return bool(self._starter.list_waiters(self._nodes.values(), processes))

    def open(self) -> None:
        """Let the behaviours be called of the nodes that have started."""
        prompt, self._prompt = self._prompt, []
        self._starter.open(prompt)

    def start_waiting(self) -> None:
        """Start what waits for something.

        Raises:
            StartError: It was not there in time.
        """
        processes = self._processes.by_name.values()
        waiters = self._starter.list_waiters(self._nodes.values(), processes)
        self._starter.start_waiting(waiters)

    def be_up(self) -> None:
        """Run from now on: all of the system has started."""
        self.open()
        self._processes.tell_ends()
        self.state.is_up = True
        self._control.begin()
        self._parameter_services.begin()

    def _tell_start(self) -> None:
        parts = _describe_parts(
            self._whole.spec.nodes,
            self.list_components(),
            [each for each in self._processes.by_name.values() if not each.spec.external],
            self.workers.names,
        )
        system_logger.info(f'{self.state.name}: {parts} ready in {self.state.uptime_sec:.2f} s')

    def _create_nodes(self) -> None:
        """Create all nodes; none of their behaviours is called yet."""
        self._starter.create(self._reading.spec.nodes.values())
        for node in self._nodes.values():
            self._executor.add_node(node.ros)

    def wait(self) -> None:
        """Wait until a stop is requested, or nobody reads the output any more."""
        self._stop_request.wait(self._stop_if_unread)

    @property
    def snapshot(self) -> Snapshot:
        """What it runs as, as its files say it."""
        set_live = {
            node.full_name: frozenset(node.parameters.set_live)
            for node in list(self._nodes.values())
            if node.parameters and node.parameters.set_live
        }
        return replace(self._whole.snapshot, set_live=set_live)

    def rewire(
        self, new: Reading, aborts_goals: Callable[[], bool], is_outdated: Callable[[], bool]
    ) -> Plan:
        """Become the system of `new`; return what was done.

        Args:
            aborts_goals: Returns whether goals of actions that go are aborted, not waited for.
            is_outdated: Returns whether there is a newer edit; then nothing is waited for.

        Raises:
            ComposerError: That failed, and the system is as it was.
        """
        plan = compare(self.snapshot, new.snapshot)
        moved = find_moved(self._whole.spec, new.spec) if self.workers.are_used else ()
        edits = [self.begin_edit(self.workers.own_part(new)), *self.workers.begin_edits(new)]
        with self.workers.editing(new, aborts_goals, is_outdated):
            try:
                for each in edits:
                    each.wait_for_goals(aborts_goals, is_outdated)
                for each in edits:
                    each.make_way(moved)
                for each in edits:
                    each.apply(is_outdated)
            except BaseException:
                for each in reversed(edits):
                    each.undo()
                raise
            for each in edits:
                each.commit()
            self._whole = new
        return plan

    def begin_edit(self, new: Reading) -> Edit:
        """Return an edit by which this process becomes what `new` says."""
        rewiring = Rewiring(
            self._nodes,
            self._processes,
            self._handle,
            self._starter,
            self._restarter,
            self._reading,
            new,
        )

        def follow() -> None:
            self._reading = new
            self._follow(new.spec)

        plan = compare(self._reading.snapshot, new.snapshot)
        return Edit(plan, rewiring, self._restarter.lock, self._stop_request, follow)

    def _follow(self, spec: SystemSpec) -> None:
        """Do what the system as a whole does as `spec` says from now on."""
        self._executor.limit_threads(self._most_threads)
        self._handle.stop_timeout_sec = self._processes.timeout_sec = spec.shutdown_timeout_sec
        self._guardian.allow(limit_stop(spec, ends_process=self._guardian.owns_process))
        self._processes.is_alone = not (spec.nodes or self.workers.names)
        self._hang_watcher.follow(spec)
        self._control.follow(spec)

    @property
    def can_start_again(self) -> bool:
        """Whether its process is its own."""
        return self._guardian.owns_process

    @property
    def starts_again(self) -> bool:
        """Whether it stops to start again in this process."""
        return self._stop_request.starts_again

    def start_again(
        self, aborts_goals: Callable[[], bool], is_outdated: Callable[[], bool]
    ) -> None:
        """Stop, and have this process start the system again as its files say it then.

        Goals in flight are waited for, or aborted as `rewire` does.

        Raises:
            StartError: There is a newer edit, and the system runs on.
        """
        nodes = list(self._nodes.values())
        actions: list[Any] = [each for node in nodes for each in node.entities['actions'].values()]
        wait_for_goals(actions, self._stop_request, aborts_goals, is_outdated)
        self._stop_request.make(starts_again=True)

    def ending(self, end: Callable[[], None]) -> AbstractContextManager[bool]:
        """Have `end` called if a stop is requested before the block ends; see `StopRequest`."""
        return self._stop_request.waking(end)

    def list_nodes(self) -> list[str]:
        """Return the full names of its nodes."""
        return [*self._nodes, *self.workers.list_nodes()]

    def list_components(self) -> list[str]:
        """Return the full names of the components that are loaded into its containers."""
        return self._components.list_names()

    def find_deliveries(self) -> Deliveries:
        """Return which way the messages of each publisher and the calls of each client go."""
        return find_deliveries(list(self._nodes.values()))

    def find_process(self, name: str) -> ExternalProcess:
        """Return an external process; see `Elsewhere`."""
        return self._processes.by_name[name]

    def find_hidden(self) -> frozenset[str]:
        """Return the full names of the nodes in workers that have not started."""
        return self.workers.find_hidden()

    def list_hidden(self) -> frozenset[str]:
        """Return the full names of the nodes of this process that have not started."""
        return find_hidden(self._nodes)

    def _find_lifecycles(self) -> dict[str, str]:
        nodes = list(self._nodes.values())
        return {node.full_name: node.lifecycle.state for node in nodes if node.lifecycle}

    def restart_node(self, full_name: str) -> Outcome:
        """Build a node anew: its entities, parameters and state are as at the start again.

        A component is unloaded and loaded.
        """
        if (worker := self.workers.find(full_name)) is not None:
            return worker.restart_node(full_name)
        if full_name in self._nodes:
            failure = self._restarter.restart(full_name)
        else:
            with self._restarter.lock:
                failure = self._components.restart(full_name)
        return Outcome(not failure, failure or f"node '{full_name}' was restarted")

    def stop(self) -> tuple[int, bool]:
        """Stop the system.

        Returns:
            The exit code, and whether all behaviours have ended. If not, their threads still
            run, and only the end of this process ends them.
        """
        self.state.is_stopping = True
        is_guarded = self._guardian.begin_stop()
        if not is_guarded:
            self._on_broken('The descriptor of the guardian was closed.')
        try:
            # Without its sockets, which are closed then, too, the middleware would not end.
            self.has_ended = self._stop() and is_guarded
        except BaseException as error:  # noqa: BLE001 - the process must end, whatever is broken
            self._stop_request.set_code(ExitCode.FAILED)
            with suppress(BaseException):
                system_logger.error(f'the stop failed: {format_internal_error(error)}')
        return self._stop_request.code, self.has_ended

    def _stop(self) -> bool:
        """Stop everything; return whether all behaviours have ended."""
        timeout_sec = self._reading.spec.shutdown_timeout_sec
        self._error_policy.stop()
        self._parameter_services.stop()
        self.workers.begin_stop()
        with self._restarter.lock:
            ended = stop_nodes(list(self._nodes.values()), timeout_sec)
        code, ended_elsewhere = self.workers.stop()
        if code:
            self._stop_request.set_code(code)
        ended &= all(node.running.wait_until_idle(0.0) for node in self._restarter.left)
        self._components.stop()
        # Processes end after the nodes: an `on_stop` may need them.
        none_killed = self._processes.stop()
        ended &= self._exits.report_hanging()
        if self._guardian.mark:
            none_killed &= end_marked(self._guardian.mark, timeout_sec, system_logger)
        if not (none_killed and ended and ended_elsewhere):
            self._stop_request.set_code(ExitCode.FAILED)
        if self._recorder is not None:
            self._recorder.stop(goes_on=self._stop_request.starts_again)
        for node in self._nodes.values():
            node.flush_counts()
        self._executor.errors.flush()
        if ended:
            self._end_graph()
        return ended

    def _end(self, code: int) -> None:
        """Stop the system, unless it stops already."""
        if not self.stop_requested:
            self.request_stop(code)

    def _stop_if_unread(self) -> None:
        if is_output_unread():
            self._stop_request.fail('nobody reads the output any more, so the system ends')

    def _on_broken(self, reason: str) -> None:
        try:
            calls = [(node.spec.key, node.running) for node in list(self._nodes.values())]
            system_logger.error(
                f'{self.label} is broken, and ends. A behaviour may have closed descriptors that '
                'are not its own, or replaced what all use. The last ones to begin were:\n'
                f'{describe_last_calls(calls)}\n{reason}'
            )
        finally:
            self._stop_request.make(ExitCode.FAILED)

    def _end_graph(self) -> None:
        self._graph_watcher.stop()
        self._control.stop()
        for node in self._nodes.values():
            self._executor.remove_node(node.ros)
        self._driver.close()
        self._executor.stop(_EXECUTOR_STOP_SEC)
        self._hang_watcher.stop()
        release(self._context)
        if not (self._guardian.owns_process and leave_graph_at_exit(self._context, self._nodes)):
            for node in self._nodes.values():
                node.destroy()
            self._nodes.clear()
        self._context.try_shutdown()
        self._context.destroy()
        if not self._guardian.owns_process:
            self._control.release_name()


def system_title(spec: SystemSpec) -> str:
    """Return the name of a system; that of the part of one host has the host's name behind it."""
    return f'{spec.name}@{spec.host}' if spec.host else spec.name


def _describe_parts(
    nodes: Collection[str],
    components: Collection[str],
    processes: Collection[ExternalProcess],
    workers: Collection[str],
) -> str:
    """Return `2 nodes, 3 components and 1 process`; what there is none of is left out."""
    counts = (
        (len(nodes), 'node', 'nodes'),
        (len(components), 'component', 'components'),
        (len(processes), 'process', 'processes'),
        (len(workers), 'worker', 'workers'),
    )
    parts = [f'{count} {one if count == 1 else many}' for count, one, many in counts if count]
    *first, last = parts or ['0 nodes']
    return f'{", ".join(first)} and {last}' if first else last
