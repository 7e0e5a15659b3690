"""What one process runs of a system: its nodes, and what starts, watches, edits and stops them."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import partial
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any, Protocol

from rclpy.exceptions import InvalidHandle

from composer.errors import ExitCode
from composer.planning.differences import compare
from composer.processes.guardian_client import end_marked
from composer.processes.process_usage import describe_processes
from composer.runtime.behaviours.running_calls import describe_last_calls
from composer.runtime.behaviours.tracebacks import format_internal_error
from composer.runtime.control.control_node import ControlNode
from composer.runtime.entities.creators import create_entity
from composer.runtime.external.external_programs import ExternalPrograms
from composer.runtime.health.deliveries import find_deliveries
from composer.runtime.health.hangs import HangWatcher
from composer.runtime.health.system_state import Outcome, SystemState, system_title
from composer.runtime.health.unmatched import GraphWatcher
from composer.runtime.health.watched_clocks import Clocks
from composer.runtime.logs import system_logger
from composer.runtime.middleware.lost_participants import find_participants
from composer.runtime.middleware.ros_context import create_ros_context, leave_graph_at_exit
from composer.runtime.middleware.ros_graph import SameNames, find_ends
from composer.runtime.middleware.shared_memory import replacing_ports
from composer.runtime.nodes.parameter_services import ParameterServiceStarter
from composer.runtime.nodes.system_handle import SystemHandle
from composer.runtime.reserved_methods import release, reserve
from composer.runtime.restart import ErrorPolicy, NodeRestarter
from composer.runtime.rewiring.edit import Edit
from composer.runtime.rewiring.rewire import Rewiring
from composer.runtime.stop import limit_stop, stop_nodes
from composer.runtime.stop_request import StopRequest
from composer.runtime.system_executor import SystemExecutor
from composer.runtime.tracing.tracer import tracer
from composer.runtime.wait_for import find_hidden

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from rclpy.context import Context
    from rclpy.node import Node

    from composer.language.specs import SystemSpec
    from composer.planning.snapshot import Snapshot
    from composer.processes.guardian_client import GuardianClient, NoGuardian
    from composer.runtime.behaviours.requests import RequestFailure
    from composer.runtime.control.control_services import AskedWorkers, Commands
    from composer.runtime.elsewhere import Elsewhere
    from composer.runtime.health.deliveries import Deliveries
    from composer.runtime.health.unmatched import GraphObserver
    from composer.runtime.messages.local_delivery import LocalTopics
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.tracing.tracer import TracePart

_EXECUTOR_STOP_SEC = 2.0
# How long a worker that is started again waits for the clients of others, of which some may go.
_LONGEST_DISCOVERY_SEC = 10.0
_POLL_SEC = 0.01


class SystemRecorder(Protocol):
    """Records the topics of a system."""

    def start(self, context: Context, topics: LocalTopics) -> None:
        """Begin, before there are nodes."""

    def stop(self) -> None:
        """End, when all nodes have stopped."""


class LocalPart:
    """All of a system that runs in this process; started once, and stopped once.

    Args:
        reading: What it runs as.
        guardian: Ends the process if the stop takes too long. If it owns the process, that exits
            after the stop, and nothing uses ROS then.
        elsewhere: What of the system is not in the nodes of this process.
        ros_arguments: The arguments after `--ros-args` of the command line.
        log_levels: The log levels of the command line.
        stop_request: The request to stop it; by default a new one.
        commands: What it does with its files when it is asked; `None` if it is not to be asked.
        recorder: Records its topics; `None` if nothing does.
        observers: What looks at the ROS graph once a second.
        worker: The worker that it is; empty in the process of the system.

    Attributes:
        workers: Those of the system, where it is the process of the system.
        has_ended: Whether everything has ended. If not, behaviours still run after `stop`, and
            only the end of this process ends them.
        state: What it says of itself.
        label: What it is called in the log.
    """

    label = 'the system'
    write_trace: Callable[[dict[str, TracePart]], object] | None = None
    workers: AskedWorkers

    def __init__(  # noqa: PLR0913 - one for each part
        self,
        reading: Reading,
        guardian: GuardianClient | NoGuardian,
        elsewhere: Elsewhere,
        ros_arguments: Sequence[str] = (),
        log_levels: Sequence[str] = (),
        *,
        stop_request: StopRequest | None = None,
        commands: Commands | None = None,
        recorder: SystemRecorder | None = None,
        observers: Iterable[GraphObserver] = (),
        worker: str = '',
    ) -> None:
        self._reading, spec = reading, reading.spec
        self._guardian = guardian
        self._recorder = recorder
        self.has_ended = False
        self._prompt: list[LiveNode] = []
        self._nodes: dict[str, LiveNode] = {}
        self.state = SystemState(system_title(spec), reading.positions.source.name)
        self.state.find_lifecycles = self._find_lifecycles
        self._stop_request = stop_request or StopRequest()
        self._context = create_ros_context(ros_arguments)
        self._executor = self._create_executor(
            log=system_logger.error,
            on_lost=partial(
                self._stop_request.fail, 'the ROS context was shut down, so the system ends'
            ),
            on_broken=self._on_broken,
            on_unanswered=self.fail_request,
        )
        reserve(self._executor, 'the executor', 'shutdown')
        self._error_policy = ErrorPolicy(self.restart_node, self.shutdown)
        self._handle = self._create_handle(elsewhere, ros_arguments, log_levels)
        self._programs = ExternalPrograms(spec, self._handle, self._nodes, self._end)
        self._processes, self._starter = self._programs.processes, self._programs.starter
        self.state.find_awaited = self._starter.awaited.copy
        self.state.find_processes = lambda: describe_processes(
            list(self._processes.by_name.values())
        )
        self._stop_request.kill_processes = self._kill_processes
        self._restarter = NodeRestarter(self._nodes, self._starter, self._handle)
        self._parameter_services = ParameterServiceStarter(self._nodes, self._restarter.lock)
        self._hang_watcher = HangWatcher(self._nodes, spec, self._executor.errors, guardian.beat)
        self._control = ControlNode(
            self, spec, self._handle.health, self._hang_watcher, commands, worker
        )
        if self._executor.runs_in_real_time:
            clocks = Clocks(self._find_ros_nodes, self.state, tells_steps=not worker)
            same_names = SameNames(self._find_ros_nodes)
            observers = (clocks, _LostServers(self._nodes), same_names, *observers)
        self._graph_watcher = GraphWatcher(
            lambda: [end for node in list(self._nodes.values()) for end in node.endpoints],
            lambda: self._any_ros,
            observers,
        )

    @property
    def _most_threads(self) -> int | None:
        """How many callbacks may run at a time; `None` for as many as block."""
        return self._reading.spec.threads

    def _create_executor(self, **calls: Any) -> SystemExecutor:
        """Return what runs the callbacks.

        Args:
            calls: Arguments of `SystemExecutor`: what it calls.
        """
        return SystemExecutor(self._context, self._most_threads, **calls)

    def _create_handle(
        self, elsewhere: Elsewhere, ros_arguments: Sequence[str], log_levels: Sequence[str]
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
            without_parameter_services=spec.without_parameter_services,
            stop_timeout_sec=spec.shutdown_timeout_sec,
            elsewhere=elsewhere,
            create_entity=create_entity,
        )

    def create(self, clients: frozenset[bytes] = frozenset()) -> None:
        """Create all nodes and entities of this process; no behaviour is called yet.

        Args:
            clients: Those that the others know; see `list_clients`.

        Raises:
            StartError: One of them cannot be created.
        """
        with replacing_ports(self._context.get_domain_id()):
            self._control.start(self._context, self._handle.ros_arguments)
            if self._recorder is not None:
                self._recorder.start(self._context, self._handle.topics)
            self._create_nodes()
        self._wait_for_clients(clients)
        self._executor.start()
        self._guardian.beat()
        self._hang_watcher.start()
        self._graph_watcher.start()
        self._parameter_services.start()
        for node in self._nodes.values():
            node.serve_at_once()
        self._executor.wake()

    def _create_nodes(self) -> None:
        """Create all nodes; none of their behaviours is called yet."""
        self._starter.create(self._reading.spec.nodes.values())
        for node in self._nodes.values():
            self._executor.add_node(node.ros)

    def list_clients(self) -> frozenset[bytes]:
        """Return the clients that this process knows; see `LostParticipants`."""
        ros = self._any_ros
        return self._handle.lost.list_clients(ros) if ros else frozenset()

    def find_participants(self) -> frozenset[bytes]:
        """Return the participants of DDS of this process; see `LostParticipants`."""
        ros = self._any_ros
        return find_participants(ros, list(self._nodes)) if ros else frozenset()

    def _wait_for_clients(self, clients: frozenset[bytes]) -> None:
        """Wait until these are known: whoever is not would get no response."""
        deadline = monotonic() + _LONGEST_DISCOVERY_SEC
        while not (self.stop_requested or clients <= self.list_clients()):
            if monotonic() > deadline:
                return
            sleep(_POLL_SEC)

    @property
    def _any_ros(self) -> Node | None:
        return next((node.ros for node in list(self._nodes.values())), self._control.ros)

    def _find_ros_nodes(self) -> list[Node]:
        control = self._control.ros
        return [node.ros for node in list(self._nodes.values())] + ([control] if control else [])

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
        self.state.is_open = True

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

    @property
    def snapshot(self) -> Snapshot:
        """What it runs as, as its files say it."""
        set_live = {
            node.full_name: frozenset(node.parameters.set_live)
            for node in list(self._nodes.values())
            if node.parameters and node.parameters.set_live
        }
        return replace(self._reading.snapshot, set_live=set_live)

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
        self._hang_watcher.follow(spec)
        self._control.follow(spec)

    def list_nodes(self) -> list[str]:
        """Return the full names of its nodes."""
        return list(self._nodes)

    def list_hidden(self) -> frozenset[str]:
        """Return the full names of the nodes of this process that have not started."""
        return find_hidden(self._nodes)

    def fail_request(self, failure: RequestFailure) -> None:
        """End the call that waits for the response to a request, in whichever process it is."""
        for node in list(self._nodes.values()):
            clients: dict[str, Any] = node.entities['service_clients']
            if any(client.fail_request(failure) for client in list(clients.values())):
                return

    def lose_servers(self, participants: Iterable[bytes]) -> None:
        """End the calls and goals that wait for servers of a process that was killed.

        Args:
            participants: See `LostParticipants`.
        """
        self._handle.lost.add(participants)
        for node in list(self._nodes.values()):
            node.lose_servers()

    def list_components(self) -> list[str]:
        """Return the full names of the components that are loaded into its containers."""
        return self._programs.components.list_names()

    def find_foreign_ends(self) -> list[tuple[str, str, str]]:
        """Return the node, noun and name of each end of components and of named processes."""
        ros = self._any_ros
        if ros is None:
            return []
        processes = self._reading.spec.processes.values()
        nodes = [
            *self.list_components(),
            *(name for each in processes for name in each.named_nodes),
        ]
        return [(node, *end) for node in dict.fromkeys(nodes) for end in find_ends(ros, node)]

    def find_deliveries(self) -> Deliveries:
        """Return which way the messages of each publisher and the calls of each client go."""
        return find_deliveries(list(self._nodes.values()))

    def _find_lifecycles(self) -> dict[str, str]:
        nodes = list(self._nodes.values())
        return {node.full_name: node.lifecycle.state for node in nodes if node.lifecycle}

    def restart_node(self, full_name: str) -> Outcome:
        """Build a node anew: its entities, parameters and state are as at the start again.

        A component is unloaded and loaded, an external process of this name ended and started.
        """
        noun = 'node' if full_name.startswith('/') else 'process'
        if not self.state.is_up and full_name in self.list_hidden():
            failure = f"node '{full_name}' has not started yet"
        elif full_name in self._nodes:
            failure = self._restarter.restart(full_name)
        elif process := self._processes.by_name.get(full_name):
            waits = not self.state.is_up and process.run is None
            failure = f"process '{full_name}' has not started yet" if waits else ''
            with self._restarter.lock:
                failure = failure or self._processes.restart(process)
        else:
            with self._restarter.lock:
                failure = self._programs.components.restart(full_name)
        return Outcome(not failure, failure or f"{noun} '{full_name}' was restarted")

    def begin_trace(self) -> None:
        """Note what happens, from now on; what was noted before is forgotten."""
        tracer.turn_on()
        self._handle.topics.follow_taps()

    def end_traces(self) -> dict[str, TracePart]:
        """Return what each process has noted, by the name of the worker."""
        return {'': self.end_trace()}

    def end_trace(self) -> TracePart:
        """Return what was noted, and note no more."""
        part = tracer.take((node.full_name, node.running) for node in list(self._nodes.values()))
        self._handle.topics.follow_taps()
        return part

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

    def shutdown(self, code: int) -> None:
        """End the whole system, because one of its nodes asks for that."""
        self._stop_request.make(code)

    def wait(self) -> None:
        """Wait until a stop is requested, or nobody reads the output any more."""
        self._stop_request.wait()

    def stop(self) -> tuple[int, bool]:
        """Stop the system.

        Returns:
            The exit code, and whether all behaviours have ended. If not, their threads still
            run, and only the end of this process ends them.
        """
        self.state.is_stopping = True
        is_guarded = self._is_guarded()
        try:
            # Without its sockets, which are closed then, too, the middleware would not end. An
            # `on_stop` may have closed them.
            self.has_ended = self._stop() and is_guarded and self._is_guarded()
        except BaseException as error:  # noqa: BLE001 - the process must end, whatever is broken
            self._stop_request.set_code(ExitCode.FAILED)
            with suppress(BaseException):
                system_logger.error(f'the stop failed: {format_internal_error(error)}')
        return self._stop_request.code, self.has_ended

    def _is_guarded(self) -> bool:
        if self._guardian.begin_stop():
            return True
        self._on_broken('The descriptor of the guardian was closed.')
        return False

    def _stop(self) -> bool:
        """Stop everything; return whether all behaviours have ended."""
        self._error_policy.stop()
        self._parameter_services.stop()
        ended = self._stop_nodes()
        ended &= all(node.running.wait_until_idle(0.0) for node in self._restarter.left)
        # Processes end after the nodes: an `on_stop` may need them.
        none_killed, exits_ended = self._programs.stop()
        ended &= exits_ended
        if self._guardian.mark:
            timeout_sec = self._reading.spec.shutdown_timeout_sec
            none_killed &= end_marked(self._guardian.mark, timeout_sec, system_logger)
        if not (none_killed and ended):
            self._stop_request.set_code(ExitCode.FAILED)
        if self._recorder is not None:
            self._recorder.stop()
        for node in self._nodes.values():
            node.flush_counts()
        self._executor.errors.flush()
        return ended and self._leave_graph()

    def _stop_nodes(self) -> bool:
        """Stop all nodes at the same time; return whether all behaviours ended in time."""
        with self._restarter.lock:
            return stop_nodes(list(self._nodes.values()), self._reading.spec.shutdown_timeout_sec)

    def _leave_graph(self) -> bool:
        """Leave the ROS graph; return whether nothing of the middleware runs any more."""
        self._graph_watcher.stop()
        self._control.stop()
        for node in self._nodes.values():
            self._executor.remove_node(node.ros)
        self._programs.leave_graph()
        if not self._executor.stop(_EXECUTOR_STOP_SEC):
            # A thread that still uses the middleware would crash as it shuts down.
            return False
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
        return True

    def _kill_processes(self) -> None:
        self._processes.kill_all()

    def _end(self, code: int) -> None:
        """Stop the system, unless it stops already."""
        if not self.stop_requested:
            self.request_stop(code)

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


class _LostServers:
    """Ends what waits for servers of other programs, once these have left the graph."""

    def __init__(self, nodes: Mapping[str, LiveNode]) -> None:
        self._nodes = nodes

    def check(self, _ros: Node) -> None:
        """See `GraphObserver`."""
        for node in list(self._nodes.values()):
            with suppress(InvalidHandle):
                node.check_servers()
