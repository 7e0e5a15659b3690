"""The records that a scenario file is parsed into.

Times are in nanoseconds of virtual time since the start of the system. Names of topics, services,
actions and nodes are full names. Every `path` leads to the place in the file.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from composer.language.specs import NodeSpec
    from composer.simulation.simulated_system import NodeAction
    from composer.simulation.topic_faults import TopicFaultKind
    from composer.yaml_text.positions import DataPath

GoalStatus: TypeAlias = Literal['succeeded', 'aborted', 'canceled', 'rejected']
# Parameters, or states of lifecycles, by full names of nodes.
ValuesByNode: TypeAlias = 'Mapping[str, Mapping[str, Any]]'


@record
class SystemReferenceSpec:
    """The system of a scenario file, as `composer up` would be given it.

    Attributes:
        file: The file of the system.
        layers: Files that change it, each over those before it.
        words: Values of its arguments, as on the command line: `name:=value`.
        set_values: Values to change, as `--set` takes them: `path=value`.
    """

    file: Path
    layers: tuple[Path, ...]
    words: tuple[str, ...]
    set_values: tuple[str, ...]
    path: DataPath


@record
class WindowSpec:
    """A span of time; both ends belong to it.

    Attributes:
        end_ns: `None` for the end of the case.
    """

    start_ns: int = 0
    end_ns: int | None = None

    def has(self, time_ns: int) -> bool:
        """Return whether a time lies in it."""
        return self.start_ns <= time_ns and (self.end_ns is None or time_ns <= self.end_ns)


@record
class ScheduleSpec:
    """When a step is done.

    Attributes:
        every_ns: The time from each to the next; `None` if it is done once.
        times: How many times; `None` for as often as fits before the end of the case.
    """

    at_ns: int
    every_ns: int | None = None
    times: int | None = None

    def list_times(self, until_ns: int) -> Iterator[int]:
        """Yield the times at which the step is done; those after the end are left out."""
        count, at = 0, self.at_ns
        while at <= until_ns and (self.times is None or count < self.times):
            yield at
            if self.every_ns is None:
                return
            count += 1
            at = self.at_ns + count * self.every_ns


@record
class PublishStepSpec:
    """A message that a scenario publishes.

    Attributes:
        message: Plain data of the fields.
        type: `None` for the type that the topic has in the system.
    """

    schedule: ScheduleSpec
    topic: str
    message: Any
    type: str | None
    path: DataPath


@record
class CallStepSpec:
    """A service call of a scenario, and the response that is expected.

    Attributes:
        request: Plain data of the fields.
        response: The fields that are compared; `None` for any response.
        fails: Whether there must be no response.
        timeout_sec: After this there is no response.
        tolerance: How far numbers may be off; see `composer.scenarios.expectations.matching`.
    """

    schedule: ScheduleSpec
    service: str
    request: Any
    response: Any
    fails: bool
    timeout_sec: float
    tolerance: float
    type: str | None
    path: DataPath


@record
class GoalStepSpec:
    """A goal of a scenario, and what is expected of it.

    Attributes:
        goal: Plain data of the fields.
        cancel_at_ns: When it is cancelled; `None` for never.
        feedback: Messages that must come in this order, others between them; `None` for any.
        result: The fields that are compared; `None` for any result.
        status: How it must end; `None` for `succeeded` if it is not cancelled, else for any.
        timeout_sec: How long an answer may take whether the goal is accepted.
    """

    schedule: ScheduleSpec
    action: str
    goal: Any
    cancel_at_ns: int | None
    feedback: tuple[Any, ...] | None
    result: Any
    status: GoalStatus | None
    timeout_sec: float
    tolerance: float
    type: str | None
    path: DataPath


@record
class SetParametersStepSpec:
    """Parameters that a scenario sets.

    Attributes:
        values: By full names of nodes, then by names of parameters.
        atomically: Whether a node sets all of its values or none.
        refused: Whether the nodes must refuse each of them.
    """

    schedule: ScheduleSpec
    values: ValuesByNode
    atomically: bool
    refused: bool
    path: DataPath


@record
class NodeStepSpec:
    """A node, or all nodes of a worker, that a scenario stops, kills, starts or restarts.

    Attributes:
        name: As written: that of the node in the file, its full name, or that of the worker.
    """

    schedule: ScheduleSpec
    action: NodeAction
    name: str
    path: DataPath


@record
class TopicFaultStepSpec:
    """What happens to the messages of a topic on their way.

    Attributes:
        seconds: For how long; `None` to the end of the case.
        delay_sec: How much later they come.
    """

    schedule: ScheduleSpec
    kind: TopicFaultKind
    topic: str
    seconds: float | None
    delay_sec: float
    path: DataPath


StepSpec: TypeAlias = (
    PublishStepSpec
    | CallStepSpec
    | GoalStepSpec
    | SetParametersStepSpec
    | NodeStepSpec
    | TopicFaultStepSpec
)


@record
class ServiceStandInSpec:
    """A service that the system calls, and a scenario answers.

    Attributes:
        response: Plain data; texts may hold expressions over `request`.
        delay_ns: The time from the request to the response.
        answers: Whether there is a response at all.
        type: `None` for the type that the service has in the system.
    """

    service: str
    response: Any
    delay_ns: int
    answers: bool
    type: str | None
    path: DataPath


@record
class FeedbackSpec:
    """A feedback message of a stand-in.

    Attributes:
        delay_ns: The time from the goal to the message.
        message: Plain data; texts may hold expressions over `goal`.
    """

    delay_ns: int
    message: Any


@record
class ActionStandInSpec:
    """An action whose goals the system sends, and a scenario executes.

    Attributes:
        accepts: Whether goals are accepted.
        feedback: By their times.
        result: Plain data; texts may hold expressions over `goal`.
        status: How a goal ends that is not cancelled.
        delay_ns: The time from the goal to the result.
        type: `None` for the type that the action has in the system.
    """

    action: str
    accepts: bool
    feedback: tuple[FeedbackSpec, ...]
    result: Any
    status: GoalStatus
    delay_ns: int
    type: str | None
    path: DataPath


@record
class SourceValueSpec:
    """A value that a source brings.

    Attributes:
        value: What its behaviour would return.
    """

    schedule: ScheduleSpec
    value: Any
    path: DataPath


@record
class SourceInputSpec:
    """What a source brings.

    Attributes:
        name: As written: that of the source, or of its node and the source, `driver/port`.
        recording: A file that has messages of its topic, or `None`.
    """

    name: str
    values: tuple[SourceValueSpec, ...]
    recording: Path | None
    path: DataPath


def find_sources(nodes: Iterable[NodeSpec], name: str) -> list[tuple[NodeSpec, str]]:
    """Return the nodes that have a source of a name as a case writes it, and its own name."""
    owner, _, source = name.rpartition('/')
    return [
        (node, source)
        for node in nodes
        if source in node.sources and owner in ('', node.key, node.full_name)
    ]


@record
class GivenSpec:
    """What a case starts from.

    Attributes:
        parameters: In place of those of the file, by full names of nodes.
        recording: A file whose messages are published at their times, or `None`.
        services: Stand-ins by full names of services.
        actions: Stand-ins by full names of actions.
        sources: What sources bring.
        replace: The objects that are put in the place of others, by the names of these, both as
            `module:name`.
    """

    parameters: ValuesByNode
    recording: Path | None
    services: Mapping[str, ServiceStandInSpec]
    actions: Mapping[str, ActionStandInSpec]
    path: DataPath
    sources: tuple[SourceInputSpec, ...] = ()
    replace: Mapping[str, str] = field(default_factory=dict)


@record
class PatternSpec:
    """Which messages of a topic are meant.

    Attributes:
        where: An expression that holds; `None` for any.
        message: The fields that are compared; `None` for none.
        tolerance: How far numbers may be off.
        where_path: Where the expression stands.
        message_path: Where the fields stand.
    """

    topic: str
    where: str | None
    message: Any
    tolerance: float
    where_path: DataPath
    message_path: DataPath
    path: DataPath


@record
class MessageExpectationSpec:
    """How many messages there must be: `where`, `eventually`, `message`, `never`, `count`.

    Attributes:
        least: The lowest number.
        most: The highest number; `None` for any.
    """

    pattern: PatternSpec
    window: WindowSpec
    least: int
    most: int | None
    path: DataPath


@record
class RateExpectationSpec:
    """How many messages a second there must be.

    Attributes:
        window: Its end does not belong to it: one second of messages at 10 Hz are ten.
    """

    pattern: PatternSpec
    window: WindowSpec
    lowest: float
    highest: float
    path: DataPath


@record
class OrderExpectationSpec:
    """Messages that must come in this order, whatever comes between them."""

    patterns: tuple[PatternSpec, ...]
    window: WindowSpec
    path: DataPath


@record
class LikeExpectationSpec:
    """A topic that must be as it was recorded: as many messages, each with the same fields.

    Attributes:
        ignored: Fields that are not compared, as in `header.stamp`.
    """

    topic: str
    recording: Path
    tolerance: float
    ignored: tuple[str, ...]
    path: DataPath


@record
class LogExpectationSpec:
    """How many lines there must be in the log.

    Attributes:
        node: A full name; `None` for any node.
        level: Lines of this level, or a higher one; `None` for all.
        text: A part of the line; `None` for any.
        regex: A regular expression that is found in the line; `None` for any.
    """

    node: str | None
    level: str | None
    text: str | None
    regex: str | None
    window: WindowSpec
    least: int
    most: int | None
    path: DataPath


@record
class ErrorExpectationSpec:
    """Errors that behaviours must raise.

    Attributes:
        node: A full name; `None` for any node.
        text: A part of the error; `None` for any.
        regex: A regular expression that is found in the error; `None` for any.
    """

    node: str | None
    text: str | None
    regex: str | None
    window: WindowSpec
    least: int
    most: int | None
    path: DataPath


@record
class ParametersExpectationSpec:
    """Values that parameters must have.

    Attributes:
        at_ns: When; `None` for the end.
        window: They must have them at some time of it, if it is given instead.
    """

    values: ValuesByNode
    at_ns: int | None
    window: WindowSpec | None
    tolerance: float
    path: DataPath


@record
class StateExpectationSpec:
    """States that lifecycles must have: see `ParametersExpectationSpec`."""

    states: Mapping[str, str]
    at_ns: int | None
    window: WindowSpec | None
    path: DataPath


@record
class ExitExpectationSpec:
    """The system must end by itself."""

    code: int
    window: WindowSpec
    path: DataPath


ExpectationSpec: TypeAlias = (
    MessageExpectationSpec
    | RateExpectationSpec
    | OrderExpectationSpec
    | LikeExpectationSpec
    | LogExpectationSpec
    | ErrorExpectationSpec
    | ParametersExpectationSpec
    | StateExpectationSpec
    | ExitExpectationSpec
)


@record
class CaseSpec:
    """A case: what is given, what happens, and what is expected then.

    Attributes:
        until_ns: When it ends.
        seed: What random choices depend on.
        real_time_limit_sec: It is ended as failed after so much real time.
    """

    name: str
    description: str
    given: GivenSpec
    steps: tuple[StepSpec, ...]
    expectations: tuple[ExpectationSpec, ...]
    until_ns: int
    seed: int
    real_time_limit_sec: float
    path: DataPath


@record
class ScenarioSpec:
    """A scenario file: a system and its cases."""

    description: str
    system: SystemReferenceSpec
    cases: Mapping[str, CaseSpec]
