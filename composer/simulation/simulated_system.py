"""A system in virtual time, as a test drives it."""

from __future__ import annotations

import threading
from collections import defaultdict
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from random import Random
from typing import TYPE_CHECKING, Any, Final, Literal, Self, TypeAlias

from composer.checks.checker import create_context
from composer.errors import ComposerError, ExitCode, StartError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared_packages import import_declared
from composer.interfaces.search_paths import extend_variables
from composer.language.pipeline import load_system_text
from composer.planning.snapshot_taking import take_snapshot
from composer.python_source.module_finder import project_search_path
from composer.runtime.behaviours.callables import project_on_path
from composer.runtime.behaviours.import_check import import_behaviours
from composer.runtime.environment import environment_set
from composer.runtime.rewiring.reading import Reading
from composer.simulation.events import Event
from composer.simulation.missed_deadlines import MissedDeadlines
from composer.simulation.project_modules import (
    forgotten_modules,
    list_project_modules,
    replaced_objects,
)
from composer.simulation.scenario_node import (
    DRIVER,
    ScenarioNode,
    SimulatedGoal,
    SimulationError,
)
from composer.simulation.simulated_run import ObservedLog, SimulatedRun, without_processes
from composer.simulation.topic_faults import TopicFault, TopicFaultKind
from composer.virtual_time.clocks import to_ns
from composer.virtual_time.replacements import replaced
from composer.virtual_time.ros_clocks import simulated_clocks
from composer.virtual_time.simulated_threads import SimulatedThreads

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping
    from types import SimpleNamespace

    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import WorkerSpec
    from composer.runtime.nodes.system_handle import EventKind
    from composer.virtual_time.unrepeatable import Notice, Watch

NodeAction: TypeAlias = Literal['stop', 'kill', 'start', 'restart']

# pytest shows where a test failed, and nothing of this module.
__tracebackhide__ = True

# 2020-01-01: a time that nobody takes for none.
START_TIME_NS: Final = 1_577_836_800_000_000_000
# The middleware sends nothing, and has no shared memory.
_ALONE: Final = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF', 'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4'}
_DRIVER_FILE: Final = f"""
version: 1
nodes: {{{DRIVER}: {{parameter_services: false, rosout: false}}}}
"""


class SimulatedSystem:
    """A system that runs in virtual time, in this process.

    Time passes only in `forward` and what else waits here. Only one can run at a time.

    Args:
        system: A system without errors; its external processes are left out.
        seed: Of what is random: the bytes of the operating system, `random`, numpy's own.
        is_shuffled: Whether the order is changed, by the seed, where another one is possible.
        start_time_ns: What clocks show at the start, in ns since 1970.
        on_event: Takes each event; by default they are kept in `events`.
        real_limit_sec: How much real time a behaviour may use without a wait.
        shows_log: Whether the lines of loggers are printed, too.

    Attributes:
        system: The one that it was given.
        events: What has happened, if `on_event` was not given.
        played: Nodes and sources that only bring what `bring` gives them.
        replaced: Objects to put in the place of others, by the names of these, as `module:name`.
            With any, sources that are not played run as they are.
    """

    def __init__(
        self,
        system: LoadedSystem,
        *,
        seed: int = 0,
        is_shuffled: bool = False,
        start_time_ns: int | None = None,
        on_event: Callable[[Event], None] | None = None,
        real_limit_sec: float = 10.0,
        shows_log: bool = False,
    ) -> None:
        self.events: list[Event] = []
        self.system = system
        self._on_event = on_event or self.events.append
        shuffle = Random(seed) if is_shuffled else None  # noqa: S311 - no secret
        self._threads = SimulatedThreads(shuffle, real_limit_sec)
        self._seed = seed
        self._start_time_ns = START_TIME_NS if start_time_ns is None else start_time_ns
        self._log = ObservedLog(
            self._observe,
            lambda: self._start_time_ns + self._threads.now_ns,
            is_shown=shows_log,
        )
        self._stack = ExitStack()
        self._run: SimulatedRun | None = None
        self._node: ScenarioNode | None = None
        self._watch: Watch | None = None
        self._deadlines: MissedDeadlines | None = None
        self.played: Collection[tuple[str, str]] = ()
        self.replaced: Mapping[str, str] = {}
        self._prepared: list[Callable[[ScenarioNode], None]] = []
        self._messages: defaultdict[str, list[Any]] = defaultdict(list)
        self._kills: defaultdict[str, int] = defaultdict(int)

    def __enter__(self) -> Self:
        """Start it."""
        self.start()
        return self

    def __exit__(self, *_error: object) -> None:
        """Stop it."""
        self.stop()

    @property
    def now(self) -> float:
        """The virtual time since the start, in seconds."""
        return self._threads.now_ns / 1e9

    @property
    def notices(self) -> list[Notice]:
        """What behaviours do that may be otherwise in another run."""
        return list(self._watch.notices) if self._watch else []

    @property
    def exit_code(self) -> int | None:
        """The exit code, once the system has ended, by itself or by `stop`."""
        return None if self._run is None else self._run.exit_code

    def start(self, timeout: float | None = 60.0) -> None:
        """Create the nodes, and run their `on_start`; virtual time may pass.

        Args:
            timeout: How much, in seconds; `None` for no limit.

        Raises:
            StartError: The system could not start, in time.
        """
        try:
            self._prepare()
            with self._threads.entered(), self._start_limit(timeout):
                self._running.start()
        except BaseException:
            with self._threads.entered():
                self._threads.close()
            self._stack.close()
            raise

    @contextmanager
    def _start_limit(self, timeout: float | None) -> Iterator[None]:
        def give_up() -> None:
            message = f'the system has not started within {timeout:g} s of virtual time'
            raise StartError(message, help='does on_start wait for what the system does not have?')

        if timeout is None:
            yield
            return
        call = self._threads.call_at(to_ns(timeout), give_up)
        yield
        self._threads.cancel(call)

    def _prepare(self) -> None:
        stack, threads = self._stack, self._threads
        if not _one_at_a_time.acquire(blocking=False):
            message = 'another simulated system runs in this process'
            raise StartError(message)
        stack.callback(_one_at_a_time.release)
        stack.enter_context(self._log.replacing())
        self._watch = stack.enter_context(replaced(threads, self._start_time_ns, self._seed))
        stack.enter_context(simulated_clocks(threads, self._start_time_ns))
        with threads.entered():
            self._run = SimulatedRun(
                self._read(), threads, self._observe, self._on_created, self._begins_source
            )
        stack.enter_context(self._run.observed_publishers())

    def _begins_source(self, node: str, source: str) -> bool:
        """Return whether a source runs as it is: without other objects there is no device."""
        return bool(self.replaced) and (node, source) not in self.played

    def _on_created(self) -> None:
        nodes = self._running.nodes
        self._node = ScenarioNode(nodes)
        self._log.publisher = self._node.create_log_publisher()
        self._deadlines = MissedDeadlines(nodes.values(), self._threads)
        for prepare in self._prepared:
            prepare(self._node)

    def _read(self) -> Reading:
        """Import the behaviours, in virtual time."""
        context = create_context(self.system, InterfaceCatalogue())
        if context is None:
            message = f"'{self.system.positions.source.name}' cannot be read"
            raise StartError(message)
        prefixes = import_declared(context.interfaces, lambda _line: None)
        variables = {**context.spec.environment, **extend_variables({}, prefixes)}
        self._stack.enter_context(environment_set({**variables, **_ALONE}))
        folders = project_search_path(self.system.files)
        self._stack.enter_context(project_on_path(folders))
        before = self._stack.enter_context(forgotten_modules(folders))
        self._stack.enter_context(replaced_objects(self.replaced, folders, before))
        functions, _findings = import_behaviours(context, context.spec)
        if self._watch is not None:
            for path in list_project_modules(folders, before).values():
                self._watch.watch_lines(path)
        snapshot = take_snapshot(context, prefixes)
        driver = load_system_text(_DRIVER_FILE).spec
        spec = without_processes(snapshot.spec, driver.nodes if driver else {})
        snapshot = replace(snapshot, spec=spec)
        return Reading(spec, self.system.positions, functions, snapshot)

    @property
    def _running(self) -> SimulatedRun:
        if self._run is None:
            message = 'the simulated system does not run'
            raise ComposerError(message)
        return self._run

    def _observe(self, kind: EventKind, node: str, name: str, value: Any) -> None:
        if kind == 'message':
            self._messages[name].append(value)
            if self._deadlines is not None:
                self._deadlines.on_message(node, name)
        elif kind == 'callback' and self._threads.current is not None:
            self._threads.current.looks = 0
        if node == f'/{DRIVER}':
            node = ''
        self._on_event(Event(self._threads.now_ns, kind, node, name, value))

    # Time

    def forward(self, seconds: float) -> None:
        """Let so much virtual time pass, with all that is due at its end."""
        with self._threads.entered():
            self._wait(None, to_ns(seconds))

    def _wait(self, condition: Callable[[], object] | None, timeout_ns: int) -> bool:
        """Wait in virtual time, but not beyond the end of the system."""
        run = self._running
        until_ns = self._threads.now_ns + timeout_ns

        threads = self._threads
        holds, is_in_time = False, True
        while is_in_time and not (holds or run.stop_requested):
            # The condition may wait itself, so it is asked in a turn of this thread, whenever
            # another thread has had one.
            turns = threads.turns
            is_in_time = threads.wait_until(
                lambda: run.stop_requested or (condition is not None and threads.turns > turns),  # noqa: B023 - called meanwhile
                until_ns - threads.now_ns,
                is_late=True,
            )
            holds = condition is not None and bool(condition())
        return holds

    def forward_until(self, condition: Callable[[], object], timeout: float = 60.0) -> bool:
        """Let virtual time pass until a condition holds; return whether it did in time."""
        with self._threads.entered():
            return bool(condition()) or self._wait(condition, to_ns(timeout))

    def at(self, seconds: float, function: Callable[[], None]) -> None:
        """Have a function called at a time since the start, in a thread that may wait."""
        self._threads.call_at(to_ns(seconds), lambda: self._begin(function))

    def _begin(self, function: Callable[[], None]) -> None:
        self._threads.start(function)

    # What a test does

    def publish(self, topic: str, payload: Any, type: str | None = None) -> None:  # noqa: A002
        """Publish on a topic; who hears it does in `forward`.

        Args:
            payload: A message, a mapping of (nested) fields, or the bare value of a message with
                one field.
            type: Its type, if nobody in the system has the topic.

        Raises:
            SimulationError: Nobody has the topic, and no type is given.
            PayloadError: The payload does not fit the type.
        """
        with self._threads.entered():
            self._started_node.publish(topic, payload, type)

    def bring(self, node: str, source: str, payload: Any) -> None:
        """Have a source bring what its behaviour would return; a node without it does nothing.

        Args:
            node: The full name of its node.
        """
        with self._threads.entered():
            if (entity := self._entities(node, 'sources').get(source)) is not None:
                entity.play(payload)

    def topic_of_source(self, node: str, source: str) -> str:
        """Return the full name of the topic that a source publishes on; empty for none."""
        entity = self._entities(node, 'sources').get(source)
        publisher = self._entities(node, 'publishers').get(entity.publisher if entity else '')
        return str(publisher.ros.topic_name) if publisher else ''

    def _entities(self, node: str, section: str) -> Mapping[str, Any]:
        owner = self._running.nodes.get(node)
        return owner.entities[section] if owner else {}

    def act_on(self, action: NodeAction, name: str) -> None:
        """Stop, kill, start or restart a node, or all nodes of a worker.

        A killed worker is started again as its `restart` says, with all of its nodes; a node that
        was stopped or killed is started again by `start` alone. Of a worker, nodes stay as they
        are to which it has happened before.

        Args:
            name: That of the node as in the file, its full name, or that of the worker.

        Raises:
            ComposerError: There is no such node, it has ended or not, or it cannot start.
        """
        spec = self.system.spec
        nodes = spec.nodes_named(name) if spec else []
        if not nodes or spec is None:
            message = f"the system has no node and no worker '{name}'"
            raise SimulationError(message)
        worker = spec.workers.get(name)
        with self._threads.entered():
            self._change_all(action, nodes, is_worker=worker is not None)
            if action == 'kill' and worker is not None:
                self._follow_kill(worker, nodes)

    def _change_all(self, action: NodeAction, nodes: list[str], *, is_worker: bool) -> None:
        for node in nodes:
            if not is_worker or (node in self._running.nodes) == (action != 'start'):
                self._change(action, node)

    def _change(self, action: NodeAction, node: str) -> None:
        run = self._running
        if action == 'start':
            run.begin_node(node)
        elif action != 'restart':
            self._started_node.note_types(node)
            run.end_node(node, is_killed=action == 'kill')
        elif not (outcome := run.restart_node(node)).succeeded:
            raise SimulationError(outcome.text)

    def _follow_kill(self, worker: WorkerSpec, nodes: list[str]) -> None:
        """Do what the system does when a worker has ended."""
        kills = self._kills[worker.name] = self._kills[worker.name] + 1
        most = worker.most_restarts
        if worker.restart == 'never' or (most is not None and kills > most):
            if worker.required:
                self._running.request_stop(ExitCode.FAILED)
            return

        begin_again = partial(self._change_all, 'start', nodes, is_worker=True)
        self.at(self.now + worker.restart_delay_sec, begin_again)

    def disturb(
        self, fault: TopicFaultKind, topic: str, seconds: float | None = None, by: float = 0.0
    ) -> None:
        """Lose, delay or double what is published on a topic, from now on.

        Args:
            fault: `drop`, `delay` or `duplicate`.
            seconds: For how long; `None` for ever.
            by: How much later messages come that are delayed, in seconds.
        """
        end_ns = None if seconds is None else self._threads.now_ns + to_ns(seconds)
        name = topic if topic.startswith('/') else f'/{topic}'
        self._running.faults.add(TopicFault(fault, name, end_ns, to_ns(by)))

    def call(
        self,
        service: str,
        request: Any = None,
        timeout: float | None = 5.0,
        type: str | None = None,  # noqa: A002
    ) -> Any:
        """Call a service and return its response; virtual time passes until it comes.

        Raises:
            SimulationError: Nobody has the service, and no type is given.
            PayloadError: The payload does not fit the request.
            CallError: There is no response; its subclasses say why.
        """
        with self._threads.entered():
            return self._started_node.call(service, request, timeout, type)

    def send_goal(
        self,
        action: str,
        goal: Any = None,
        timeout: float | None = 5.0,
        type: str | None = None,  # noqa: A002
    ) -> SimulatedGoal:
        """Send a goal, and return it when the server has accepted it.

        Raises:
            SimulationError: Nobody has the action, and no type is given.
            PayloadError: The payload does not fit the goal.
            ActionNotAvailableError: No server appeared in time.
            GoalTimeoutError: It did not answer in time.
            GoalRejectedError: It refused the goal.
        """
        with self._threads.entered():
            sent = self._started_node.send_goal(action, goal, timeout, type)
        return EnteringGoal(sent, self._threads)

    def set_parameters(
        self, node: str, values: Mapping[str, Any], *, atomically: bool = False
    ) -> None:
        """Set parameters of a node.

        Args:
            atomically: Whether it sets all of them or none.

        Raises:
            ParametersRefusedError: It refused one of them; otherwise the others may be set.
        """
        with self._threads.entered():
            self._started_node.set_parameters(node, values, atomically=atomically)

    def parameters(self, node: str) -> dict[str, Any]:
        """Return the values of the parameters of a node."""
        return self._started_node.get_parameters(node)

    def state(self, node: str) -> SimpleNamespace:
        """Return what the behaviours of a node share as `node.state`."""
        return self._started_node.state(node)

    def messages(self, topic: str) -> list[Any]:
        """Return what was published on a topic so far, by the system and by the test."""
        return self._messages[topic if topic.startswith('/') else f'/{topic}']

    def serve(
        self,
        service: str,
        answer: Callable[[Any], Any],
        type: str | None = None,  # noqa: A002
    ) -> None:
        """Serve a service that the system calls; before the start, or later.

        Args:
            answer: Returns the payload of the response for a request; it may wait, and raise.
        """
        self._prepare_node(lambda node: node.serve(service, answer, type))

    def serve_action(
        self,
        action: str,
        execute: Callable[[Any], Iterator[Any]],
        type: str | None = None,  # noqa: A002
        *,
        accepts: bool = True,
    ) -> None:
        """Serve an action that the system sends goals to; before the start, or later.

        Args:
            execute: A generator: yields feedback payloads, and returns that of the result.
            accepts: Whether goals are accepted.
        """
        self._prepare_node(lambda node: node.serve_action(action, execute, type, accepts=accepts))

    def _prepare_node(self, prepare: Callable[[ScenarioNode], None]) -> None:
        if self._node is None:
            self._prepared.append(prepare)
            return
        with self._threads.entered():
            prepare(self._node)

    @property
    def _started_node(self) -> ScenarioNode:
        if self._node is None:
            message = 'the simulated system has not started'
            raise ComposerError(message)
        return self._node

    def stop(self) -> None:
        """Stop the system, as a signal does; a second time does nothing."""
        with self._stack:
            if self._run is None or self._run.has_ended:
                return
            with self._threads.entered():
                self._run.stop()
                self._threads.close()


_one_at_a_time = threading.Lock()


class EnteringGoal(SimulatedGoal):
    """A goal of a test, which waits in virtual time."""

    def __init__(self, goal: SimulatedGoal, threads: SimulatedThreads) -> None:
        super().__init__(goal.goal)
        self._threads = threads

    def cancel(self, timeout: float | None = 5.0) -> bool:
        """See the base class."""
        with self._threads.entered():
            return super().cancel(timeout)
