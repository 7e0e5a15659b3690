"""Runs a case: what it is given, what happens, and whether that is what is expected."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.checks.checker import create_context
from composer.errors import ComposerError, ExitCode, StartError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.parsing.parameter_references import with_values
from composer.language.specs import ParameterFileSpec
from composer.language.values.parameter_values import StartingValues
from composer.recordings.reading import read_recording
from composer.ros_parameters.file_writer import render_parameter_file
from composer.ros_parameters.parameter_types import convert_parameter_value, infer_parameter_type
from composer.runtime.tracing.tracer import tracer
from composer.scenarios.expectations.evaluation import evaluate
from composer.scenarios.expectations.log_expectations import START, expects_refusal
from composer.scenarios.running.case_results import CaseFailure, CaseResult
from composer.scenarios.running.case_steps import CaseSteps
from composer.scenarios.running.failure_reports import describe_error, describe_failure, list_log
from composer.scenarios.running.stand_in_servers import StandIns, is_of_stand_in
from composer.scenarios.specs import ParametersExpectationSpec, find_sources
from composer.scenarios.times import NANOSECONDS
from composer.simulation.events import Event
from composer.simulation.simulated_system import SimulatedSystem
from composer.simulation.trace import render_event
from composer.virtual_time.clocks import MONOTONIC_START_NS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import NodeSpec, SystemSpec
    from composer.recordings.reading import Recording
    from composer.scenarios.running.case_results import CaseRequest
    from composer.scenarios.scenario_files import LoadedScenarios
    from composer.scenarios.specs import CaseSpec, GivenSpec, ValuesByNode
    from composer.virtual_time.unrepeatable import Notice

# A behaviour may use so much of the limit of its case before it counts as stuck: the rest is for
# telling so, with the events before.
_SHARE = 0.8


def run_case(loaded: LoadedScenarios, case: CaseSpec, request: CaseRequest) -> CaseResult:
    """Run a case in this process; return what came of it.

    Raises:
        ComposerError: The trace cannot be written.
    """
    seed = (case.seed if request.seed is None else request.seed) + max(0, request.shuffle - 1)
    try:
        run = _CaseRun(loaded, case, seed, request)
    except ComposerError as error:
        return CaseResult((CaseFailure('start', str(error)),), seed)
    if request.timeline:
        tracer.turn_on(MONOTONIC_START_NS)
    failures = run.run()
    simulated = run.simulated
    if request.trace:
        _write_trace(request.trace, simulated)
    if request.timeline:
        part = tracer.take(())
        end_ns = part.begun_ns + int(run.simulated_sec * 1e9)
        Path(request.timeline).write_text(json.dumps(part._replace(ended_ns=end_ns)))
    if not any(failure.kind in ('start', 'stuck') for failure in failures):
        found = evaluate(case, run.events, run.steps.outcomes(), parameters=run.parameters)
        failures += [describe_failure(loaded, each, run.events) for each in found]
    return CaseResult(
        failures=tuple(failures),
        seed=seed,
        simulated_sec=round(run.simulated_sec, 9),
        notices=tuple(map(_describe_notice, simulated.notices)),
        log=tuple(list_log(each for each in simulated.events if not is_of_stand_in(each))),
    )


class _CaseRun:
    """One run of a case."""

    def __init__(
        self, loaded: LoadedScenarios, case: CaseSpec, seed: int, request: CaseRequest
    ) -> None:
        if loaded.system is None:
            message = f'{loaded.path}: its system cannot be read'
            raise ComposerError(message)
        given = case.given
        self._sources = SourceInput(given, loaded.system.spec)
        recording = read_recording(given.recording) if given.recording else None
        self._case = case
        self.simulated_sec = 0.0
        self.events: list[Event] = []
        self.parameters: dict[str, dict[str, Any]] = {}
        self.simulated = SimulatedSystem(
            with_parameters(loaded.system, given.parameters),
            seed=seed,
            is_shuffled=request.shuffle > 0,
            start_time_ns=recording.start_ns if recording else self._sources.start_ns,
            real_limit_sec=_SHARE * (request.real_time_limit_sec or case.real_time_limit_sec),
            shows_log=not request.captures,
        )
        stop_sec = loaded.system.spec.shutdown_timeout_sec if loaded.system.spec else 0.0
        self.simulated.played, self.simulated.replaced = self._sources.played, given.replace
        self.stand_ins = StandIns(self.simulated, given, stop_sec)
        self.steps = CaseSteps(self.simulated, loaded, case)
        self._input = (
            RecordingInput(self.simulated, recording, loaded.system) if recording else None
        )

    def run(self) -> list[CaseFailure]:
        """Let it all happen; return what went wrong beside expectations that are not met."""
        simulated, case = self.simulated, self._case
        try:
            self.stand_ins.serve()
            self.steps.schedule()
            self._sources.schedule(simulated, case.until_ns)
            if self._input:
                self._input.schedule()
            try:
                simulated.start(timeout=case.until_ns / NANOSECONDS)
            except StartError as error:
                if not expects_refusal(case):
                    raise
                self._note_refusal(error)
                return self.steps.failures
            self._note_parameters()
            simulated.forward(max(0.0, case.until_ns / NANOSECONDS - simulated.now))
            self._stop()
        except ComposerError as error:
            # Nothing more is done with a system that is stuck: its process ends.
            return [describe_error(error, simulated.events)]
        return self.steps.failures

    def _stop(self) -> None:
        """Stop the system: what its behaviours do then counts, states of lifecycles do not."""
        simulated = self.simulated
        self.simulated_sec = simulated.now
        if simulated.exit_code is not None:
            time_ns = round(simulated.now * NANOSECONDS)
            simulated.events.append(Event(time_ns, 'exit', '', '', simulated.exit_code))
        number = len(simulated.events)
        self.steps.has_ended = True
        self.stand_ins.end()
        simulated.stop()
        happened = [each for each in simulated.events if not is_of_stand_in(each)]
        at_stop = simulated.events[number:]
        left_out = {id(each) for each in at_stop if each.kind == 'state'}
        self.events = [each for each in happened if id(each) not in left_out]

    def _note_refusal(self, error: StartError) -> None:
        """Note that the system has refused to start, by an error of a behaviour or its own."""
        events, system = self.simulated.events, self.simulated.system
        self.simulated_sec = self.simulated.now
        time_ns = round(self.simulated.now * NANOSECONDS)
        nodes = system.spec.nodes.values() if system.spec else ()
        if not any(event.kind == 'error' for event in events):
            named = (each for each in nodes if str(error).startswith(f"node '{each.key}'"))
            node = next((each.full_name for each in named), '')
            events.append(Event(time_ns, 'error', node, START, str(error)))
        events.append(Event(time_ns, 'exit', '', START, int(ExitCode.FAILED)))
        self.events = [each for each in events if not is_of_stand_in(each)]

    def _note_parameters(self) -> None:
        for expected in self._case.expectations:
            if isinstance(expected, ParametersExpectationSpec):
                for node in expected.values:
                    self.parameters[node] = self.simulated.parameters(node)


def with_parameters(system: LoadedSystem, values: ValuesByNode) -> LoadedSystem:
    """Return a system whose nodes start with other values of parameters.

    Args:
        values: By full names of nodes.
    """
    if not values or system.spec is None:
        return system
    nodes = {
        key: _with_values(node, values.get(node.full_name, {}))
        for key, node in system.spec.nodes.items()
    }
    return replace(system, spec=replace(system.spec, nodes=nodes))


def _with_values(node: NodeSpec, values: Mapping[str, Any]) -> NodeSpec:
    parameters, typed = dict(node.parameters), {}
    for name, value in values.items():
        spec = parameters.get(name)
        type_name = (spec and spec.type) or infer_parameter_type(value)
        typed[name] = str(type_name), convert_parameter_value(value, type_name)
        if spec is not None:
            parameters[name] = replace(spec, value=typed[name][1])
    files = node.parameter_files
    if files and values:
        # The last one wins.
        handle, path = tempfile.mkstemp('.yaml', 'given-', os.environ.get('ROS_LOG_DIR'))
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            file.write(render_parameter_file({node.full_name: typed}))
        files = (*files, ParameterFileSpec(path))
    given = replace(node, parameters=parameters, parameter_files=files)
    return with_values(given, StartingValues(()).of_node(given))


def _write_trace(path: str, simulated: SimulatedSystem) -> None:
    with open(path, 'w', encoding='utf-8') as trace:  # noqa: PTH123 - as quick as it gets
        trace.writelines(f'{render_event(event)}\n' for event in simulated.events)


def _describe_notice(notice: Notice) -> str:
    return f'{notice.file}:{notice.line}: {notice.what}'


class RecordingInput:
    """Publishes what a recording has, one message after the other, each decoded in its turn.

    Args:
        recording: Its first message is published at the start of the system.
    """

    def __init__(
        self, simulated: SimulatedSystem, recording: Recording, system: LoadedSystem
    ) -> None:
        self._simulated = simulated
        self._start_ns = recording.start_ns
        self._types = {topic.name: topic.type for topic in recording.topics}
        self._messages = recording.messages(list_external_topics(system))

    def schedule(self) -> None:
        """Ask for the next message at its time."""
        message = next(self._messages, None)
        if message is not None:
            seconds = (message[0] - self._start_ns) / NANOSECONDS
            self._simulated.at(seconds, lambda: self._publish(*message[1:]))

    def _publish(self, topic: str, message: Any) -> None:
        self.schedule()
        self._simulated.publish(topic, message, self._types[topic])


def list_external_topics(system: LoadedSystem) -> set[str]:
    """Return the full names of the topics that nodes hear and none of them publishes.

    What external processes publish counts as external: they do not run.
    """
    context = create_context(system, InterfaceCatalogue())
    if context is None:
        return set()
    topology = context.topology
    created = {name for kind, name, provides in topology.created if kind == 'topic' and provides}
    return {
        channel.name
        for channel in topology.of_kind('topic')
        if any(not end.is_declared for end in channel.users)
        and all(end.is_declared for end in channel.providers)
    } - created


class SourceInput:
    """Lets sources bring what a case gives them.

    Attributes:
        played: The full names of the nodes, and the names of the sources.
        start_ns: When the first of the recordings begins; `None` without one.
    """

    def __init__(self, given: GivenSpec, system: SystemSpec | None) -> None:
        nodes = system.nodes.values() if system else ()
        self._inputs = [
            (source, node.full_name, name)
            for source in given.sources
            for node, name in find_sources(nodes, source.name)[:1]
        ]
        self.played = frozenset((node, name) for _, node, name in self._inputs)
        self._recordings = {
            source.path: read_recording(source.recording)
            for source, *_ in self._inputs
            if source.recording is not None
        }
        starts = [each.start_ns for each in self._recordings.values()]
        self.start_ns = min(starts, default=None)

    def schedule(self, simulated: SimulatedSystem, until_ns: int) -> None:
        """Ask for each value at its time."""
        for source, node, name in self._inputs:
            if recording := self._recordings.get(source.path):
                simulated.at(0, partial(self._play, simulated, recording, node, name))
            for value in source.values:
                for time_ns in value.schedule.list_times(until_ns):
                    bring = partial(simulated.bring, node, name, value.value)
                    simulated.at(time_ns / NANOSECONDS, bring)

    def _play(
        self, simulated: SimulatedSystem, recording: Recording, node: str, name: str
    ) -> None:
        topic = simulated.topic_of_source(node, name)
        self._play_next(simulated, recording.messages({topic}), node, name)

    def _play_next(
        self, simulated: SimulatedSystem, messages: Iterator[Any], node: str, name: str
    ) -> None:
        message = next(messages, None)
        if message is None or self.start_ns is None:
            return

        def bring() -> None:
            self._play_next(simulated, messages, node, name)
            simulated.bring(node, name, message[2])

        simulated.at((message[0] - self.start_ns) / NANOSECONDS, bring)
