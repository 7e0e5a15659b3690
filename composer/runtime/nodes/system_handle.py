"""What the nodes of a system share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.runtime.health.statistics import HealthRegistry
from composer.runtime.messages.local_delivery import LocalTopics
from composer.runtime.messages.local_services import LocalServices
from composer.runtime.messages.ownership import ownership_of
from composer.runtime.middleware.lost_participants import LostParticipants

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rclpy.context import Context

    from composer.language.specs import OnError, QosSpec
    from composer.ros_parameters.file_reader import ParameterEntry
    from composer.runtime.elsewhere import Elsewhere
    from composer.runtime.nodes.live_entity import LiveEntity
    from composer.runtime.stop_request import StopRequest
    from composer.runtime.system_executor import SystemExecutor
    from composer.yaml_text.positions import SourceMap


# What may happen in a system that is observed; see `Event`.
EventKind: TypeAlias = Literal[
    'message',
    'request',
    'response',
    'goal',
    'cancel',
    'feedback',
    'result',
    'parameter',
    'state',
    'log',
    'callback',
    'error',
    'exit',
]
Observe: TypeAlias = 'Callable[[EventKind, str, str, Any], None]'


def never() -> bool:
    """Return `False`."""
    return False


@dataclass(slots=True)
class SystemHandle:
    """What nodes need of the system that they belong to.

    Attributes:
        positions: Where the parts of the system were written.
        profiles: The named QoS profiles of the file.
        functions: The behaviours, by their names.
        parameter_files: What the parameter files of nodes say, see `Snapshot.overrides`.
        ros_arguments: The arguments after `--ros-args` of the command line.
        log_levels: The log levels of the command line, see `composer.runtime.logs.log_levels`.
        act_on_error: Takes a node's full name and what to do after an error in it.
        shutdown: Ends the system with an exit code.
        executor: Runs the callbacks of all nodes.
        stop: The request to stop the system.
        without_parameter_services: The full names of the nodes that have none.
        stop_timeout_sec: What running behaviours get to end.
        elsewhere: What of the system is not in the nodes of this process.
        create_entity: Creates one entity more of a `LiveNode`, of a section, from its record.
        observe: Takes what happens, with a kind of `Event`, a node, a name and a value; `None` if
            nobody wants to know.
        begins_source: Returns whether a source of a node begins, and nothing is played instead.
        is_outdated: Returns whether a reload is waited for in vain, as there is a newer edit.
        health: The health of the system's entities.
        topics: Hands messages over between its nodes.
        services: Hands requests over between its nodes.
        lost: The participants of DDS whose processes were killed.
    """

    context: Context
    positions: SourceMap
    profiles: Mapping[str, QosSpec]
    functions: Mapping[str, Callable[..., Any]]
    parameter_files: Mapping[str, Mapping[str, ParameterEntry]]
    ros_arguments: Sequence[str]
    log_levels: Sequence[str]
    act_on_error: Callable[[str, OnError], None]
    shutdown: Callable[[int], None]
    executor: SystemExecutor
    stop: StopRequest
    without_parameter_services: frozenset[str]
    stop_timeout_sec: float
    elsewhere: Elsewhere
    create_entity: Callable[[Any, str, Any], LiveEntity]
    observe: Observe | None = None
    begins_source: Callable[[str, str], bool] = lambda _node, _source: True
    is_outdated: Callable[[], bool] = never
    health: HealthRegistry = field(default_factory=HealthRegistry)
    lost: LostParticipants = field(default_factory=LostParticipants)
    topics: LocalTopics = field(init=False)
    services: LocalServices = field(init=False)

    def __post_init__(self) -> None:
        self.topics = LocalTopics(self.executor)
        self.services = LocalServices(self.executor)

    def tell(self, kind: EventKind, node: str, name: str, message: Any) -> None:
        """Tell who observes what came to its end, with a message that somebody may change."""
        if self.observe is not None:
            message_class: type = type(message)
            self.observe(kind, node, name, ownership_of(message_class).copy(message))
