"""A system as its file declares it: a frozen record for each part of the language.

Every record carries the path of its data, under which a `SourceMap` knows where it was written.
`warn_after_sec` is how long a behaviour may run before it is reported, `None` for ever.
`local_delivery` is whether messages, calls or goals may be handed over within the process.
`by_parameter` has the values that follow parameters of the node, by their keys in the file.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

from composer.entity_kinds import CHANNEL_KINDS, ENTITY_KINDS, KIND_OF_SECTION
from composer.names import join_names
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from composer.entity_kinds import EntityKind
    from composer.yaml_text.positions import DataPath

SpecT = TypeVar('SpecT')

LogLevel: TypeAlias = Literal['debug', 'info', 'warn', 'error', 'fatal']
OnError: TypeAlias = Literal['log', 'restart', 'shutdown']
ClockName: TypeAlias = Literal['ros', 'steady', 'system']
Introspection: TypeAlias = Literal['off', 'metadata', 'contents']
Concurrency: TypeAlias = Literal['parallel', 'queue', 'reject', 'preempt']

ConditionKind: TypeAlias = Literal['topic', 'service', 'action', 'node', 'process']
LifecycleStart: TypeAlias = Literal['unconfigured', 'inactive', 'active']
LifecycleState: TypeAlias = Literal['unconfigured', 'inactive', 'active', 'finalized']
DrivenState: TypeAlias = Literal['inactive', 'active']
WhileInactive: TypeAlias = Literal['drop', 'keep']
ProcessState: TypeAlias = Literal['running', 'ended', 'succeeded']
RestartRule: TypeAlias = Literal['always', 'on_failure', 'never']
Discovery: TypeAlias = Literal['multicast', 'peers', 'discovery_server', 'zenoh']

DEFAULT_SHUTDOWN_TIMEOUT_SEC = 5.0
DEFAULT_WAIT_SEC = 30.0
DEFAULT_RESTART_DELAY_SEC = 1.0
DEFAULT_HOST_FOLDER = '~/.local/share/composer'
# Those of `fastdds discovery` and of `zenohd`.
DEFAULT_SERVER_PORT = 11811
DEFAULT_ROUTER_PORT = 7447
# `ros2 launch` gives its processes 5 s after SIGINT, and 5 s after SIGTERM, until it kills them.
DEFAULT_LAUNCH_STOP_SEC = 15.0
DEFAULT_DIAGNOSTICS_PERIOD_SEC = 1.0
DEFAULT_WARN_AFTER_SEC = 5.0
REENTRANT = 'reentrant'


@record
class BehaviourSpec:
    """A Python function by name, with constant keyword arguments.

    Attributes:
        function: Its name, or `Class.method`.
    """

    module: str
    function: str
    arguments: Mapping[str, Any]
    path: DataPath

    @property
    def class_name(self) -> str:
        """The class, if it is a method; otherwise empty."""
        return self.function.rpartition('.')[0]

    @property
    def method_name(self) -> str:
        """The name of the method or function alone."""
        return self.function.rpartition('.')[2]

    @property
    def name(self) -> str:
        """Return `package.module:function`."""
        return f'{self.module}:{self.function}'


@record
class ParameterReference:
    """A value that follows a parameter of its node.

    Attributes:
        format: The text in which the value stands for `{}`.
        scale: What a number is multiplied by.
    """

    parameter: str
    format: str
    scale: float
    path: DataPath


@record
class QosSpec:
    """QoS as written: a profile's name and the policies that differ from it.

    Attributes:
        policies: By the keys of the language; durations in seconds, or `'infinite'`.
    """

    profile: str
    policies: Mapping[str, Any]
    path: DataPath


@record
class ParameterSpec:
    """A ROS parameter.

    Attributes:
        type: A name as in `double_array`; `None` if neither given nor told by the value.
        value: What it starts with, `None` if it is not set.
        step: Values are minimum + n * step, or maximum.
    """

    name: str
    type: str | None
    value: Any
    description: str
    read_only: bool
    minimum: float | None
    maximum: float | None
    step: float | None
    choices: tuple[Any, ...] | None
    path: DataPath


@record
class PublisherSpec:
    """A publisher.

    Attributes:
        external: Whether its subscriptions are in no file.
        active: Whether it is there from the start.
        made_by: `library` if a library creates it; otherwise empty.
        qos_overrides: The policies that ROS parameters can override.
    """

    name: str
    type: str
    topic: str
    qos: QosSpec
    qos_overrides: tuple[str, ...]
    on_deadline_missed: BehaviourSpec | None
    on_liveliness_lost: BehaviourSpec | None
    on_incompatible_qos: BehaviourSpec | None
    on_matched: BehaviourSpec | None
    local_delivery: bool
    external: bool
    active: bool
    made_by: str
    path: DataPath
    by_parameter: Mapping[str, ParameterReference] = field(default_factory=dict)


@record
class SubscriptionSpec:
    """A subscription.

    Attributes:
        behaviour: `None` if messages are passed on as they are.
        publish: The publisher for what the behaviour returns, or `None`.
        group: The callback group's name; `None` for the node's default group.
        read_only: Whether it shares its messages with others, as its behaviour only reads them.
        while_inactive: What becomes of messages while the node has a lifecycle and is not active;
            `None` for what fits the durability.
        external: Whether its publishers are in no file.
        active: Whether it is there from the start.
        made_by: `library` if a library creates it; otherwise empty.
        qos_overrides: The policies that ROS parameters can override.
        raw: Whether its behaviour gets serialised messages.
        content_filter: The `expression` and the `parameters`; empty for all messages.
    """

    name: str
    type: str
    topic: str
    qos: QosSpec
    behaviour: BehaviourSpec | None
    publish: str | None
    group: str | None
    read_only: bool
    qos_overrides: tuple[str, ...]
    raw: bool
    content_filter: Mapping[str, Any]
    on_deadline_missed: BehaviourSpec | None
    on_liveliness_changed: BehaviourSpec | None
    on_incompatible_qos: BehaviourSpec | None
    on_message_lost: BehaviourSpec | None
    on_matched: BehaviourSpec | None
    while_inactive: WhileInactive | None
    on_error: OnError
    external: bool
    active: bool
    made_by: str
    warn_after_sec: float | None
    path: DataPath
    by_parameter: Mapping[str, ParameterReference] = field(default_factory=dict)


@record
class TimerSpec:
    """A timer.

    Attributes:
        behaviour: `None` if it publishes the constant `message`.
        message: The payload, if there is no behaviour.
    """

    name: str
    period_sec: float
    behaviour: BehaviourSpec | None
    publish: str | None
    message: Any
    clock: ClockName
    group: str | None
    on_error: OnError
    warn_after_sec: float | None
    path: DataPath
    by_parameter: Mapping[str, ParameterReference] = field(default_factory=dict)


@record
class SourceSpec:
    """A source: something that blocks, called again and again in a thread of its own.

    Attributes:
        cancel: Called when it is to end, to end the wait of its behaviour.
    """

    name: str
    behaviour: BehaviourSpec
    cancel: BehaviourSpec | None
    publish: str | None
    on_error: OnError
    warn_after_sec: float | None
    path: DataPath


@record
class ServiceSpec:
    """A service that the node serves.

    Attributes:
        group: The callback group's name; `None` for the node's default group.
        while_inactive: What becomes of requests while the node has a lifecycle and is not active;
            `None` is `drop`.
    """

    name: str
    type: str
    service: str
    qos: QosSpec
    behaviour: BehaviourSpec
    group: str | None
    while_inactive: WhileInactive | None
    introspection: Introspection
    local_delivery: bool
    on_error: OnError
    warn_after_sec: float | None
    path: DataPath
    by_parameter: Mapping[str, ParameterReference] = field(default_factory=dict)


@record
class ServiceClientSpec:
    """A service that behaviours call.

    Attributes:
        external: Whether its server is in no file.
    """

    name: str
    type: str
    service: str
    qos: QosSpec
    introspection: Introspection
    local_delivery: bool
    external: bool
    path: DataPath
    by_parameter: Mapping[str, ParameterReference] = field(default_factory=dict)


@record
class ActionSpec:
    """An action that the node serves.

    Attributes:
        accept: Decides whether a goal is accepted; `None` accepts all.
    """

    name: str
    type: str
    action: str
    behaviour: BehaviourSpec
    accept: BehaviourSpec | None
    concurrency: Concurrency
    local_delivery: bool
    on_error: OnError
    warn_after_sec: float | None
    path: DataPath
    by_parameter: Mapping[str, ParameterReference] = field(default_factory=dict)


@record
class ActionClientSpec:
    """An action that behaviours send goals to.

    Attributes:
        feedback: Hears the feedback to each goal.
        result: Hears the result of each goal.
        external: Whether its server is in no file.
    """

    name: str
    type: str
    action: str
    feedback: BehaviourSpec | None
    result: BehaviourSpec | None
    local_delivery: bool
    external: bool
    path: DataPath
    by_parameter: Mapping[str, ParameterReference] = field(default_factory=dict)


# What meets others of its kind under a name.
TopicEndSpec: TypeAlias = PublisherSpec | SubscriptionSpec
EndSpec: TypeAlias = TopicEndSpec | ServiceSpec | ServiceClientSpec | ActionSpec | ActionClientSpec


# All that stands in a section of a node.
EntitySpec: TypeAlias = ParameterSpec | TimerSpec | EndSpec


@record
class ParameterFileSpec:
    """A parameter file in ROS's own format.

    Attributes:
        file: A path, or `package://name/path`.
        root: The namespace that its names of nodes are put in; empty for none.
        expressions: What its expressions have in scope, as a JSON object; `None` if the file is
            used as it is.
    """

    file: str
    root: str = ''
    expressions: str | None = None

    @property
    def is_changed(self) -> bool:
        """Whether ROS reads something else than the file itself."""
        return bool(self.root.strip('/')) or self.expressions is not None


@record
class ConditionSpec:
    """Something that must be there before a node or process starts.

    Attributes:
        kind: What sort of thing it is.
        name: Its name as written; a relative one lies in the namespace of who waits.
        timeout_sec: After this the start fails.
        state: What a process must have come to; `None` if it may run or have succeeded. Or the
            state that a node must be in, which has a lifecycle; `None` for any.
    """

    kind: ConditionKind
    name: str
    timeout_sec: float
    state: ProcessState | LifecycleState | None
    path: DataPath


@record
class ExitActionSpec:
    """What happens when a process has ended for good: the system stops if neither is given.

    Attributes:
        behaviour: A function to call, or `None`.
        start: The name of a process to start, or `None`.
    """

    behaviour: BehaviourSpec | None
    start: str | None
    path: DataPath

    @property
    def ends_system(self) -> bool:
        """Whether the system stops."""
        return self.behaviour is None and self.start is None


@record
class DeclaredEndSpec:
    """A publisher, client, ... that a node of an external process is said to have.

    Attributes:
        channel: The name of its topic, service or action, as written.
        qos: `None` if it is an action's, which has none.
        external: Whether the other end may be in no file.
    """

    name: str
    type: str
    channel: str
    qos: QosSpec | None
    external: bool
    path: DataPath


@record
class DeclaredNodeSpec:
    """A node of an external process, as far as the file declares it.

    Attributes:
        name: Its name; that of the process if nothing tells it.
        is_named: Whether the file tells the name of the node.
        namespace: In full, as in `/robot`.
        remap: The rules of the process.
        sections: Its ends by section and name; `None` if they are not declared.
        parameters: Those that are declared.
        declares_all_parameters: Whether it has no other parameters.
        process: The key of its process.
        host: The host of its process.
    """

    name: str
    is_named: bool
    namespace: str
    remap: tuple[tuple[str, str], ...]
    sections: Mapping[str, Mapping[str, DeclaredEndSpec]] | None
    parameters: Mapping[str, ParameterSpec]
    declares_all_parameters: bool
    process: str
    path: DataPath
    host: str = ''

    @property
    def full_name(self) -> str:
        """Its name in its namespace, as in `/robot/camera`."""
        return join_names(self.namespace, self.name)

    def ends(self) -> Iterator[tuple[EntityKind, DeclaredEndSpec]]:
        """Yield all ends that are declared, each with its kind."""
        for section, entries in (self.sections or {}).items():
            for end in entries.values():
                yield KIND_OF_SECTION[section], end


@record
class ComponentSpec:
    """A node that a container loads.

    Attributes:
        namespace: In full, as in `/robot`.
        package: The ROS package of the plugin.
        plugin: The class, as in `image_proc::RectifyNode`.
        remap: Rules, from and to; the first that matches wins.
        types: Those of the parameters that are declared.
        intra_process: Whether messages within the container are handed over.
        lifecycle: The state that it is brought to; `None` to leave it alone.
        extra_arguments: What else the container is given with the request.
        is_named: Whether its node has the name of the component, and not one of the plugin's own.
        container: The name of the container.
    """

    name: str
    namespace: str
    description: str
    package: str
    plugin: str
    parameters: Mapping[str, Any]
    types: Mapping[str, str]
    parameter_files: tuple[ParameterFileSpec, ...]
    remap: tuple[tuple[str, str], ...]
    log_level: LogLevel | None
    intra_process: bool
    extra_arguments: Mapping[str, Any]
    is_named: bool
    wait_for: tuple[ConditionSpec, ...]
    lifecycle: DrivenState | None
    container: str
    path: DataPath

    @property
    def key(self) -> str:
        """Its key in the file: its name, or its full name."""
        return str(self.path[-1])

    @property
    def full_name(self) -> str:
        """Its name in its namespace, as in `/robot/rectify`."""
        return join_names(self.namespace, self.name)


@record
class ProcessSpec:
    """A program that runs beside the nodes.

    Attributes:
        command: The program and its arguments; empty if it is an executable of a package.
        launch: The launch file that it runs, if it does: absolute, or `package://name/path`.
        arguments: Those of the executable; `name:=value` for a launch file.
        node_name: The name of the node in it; `None` for the one that the program gives itself.
        namespace: The namespace of the nodes in it; `None` if the program has none.
        nodes: The nodes in it that the file names or declares.
        declares_all_ends: Whether these have all the ends that it has.
        lifecycle: The state that these are brought to; `None` to leave them alone.
        cwd: The folder it runs in; `None` for that of Composer.
        restart: When it is started again.
        most_restarts: How many times; `None` for no end.
        stop_signal: The signal that asks it to end.
        on_exit: What happens when it has ended and is not started again.
        stop_timeout_sec: After this it is killed, after half of it it gets SIGTERM; `None` for the
            system's own.
        delay_sec: Time between the moment when its conditions hold and its start.
        on_demand: Whether it only starts when the `on_exit` of another one starts it.
        components: What is loaded into it, if it is a container.
        external: Whether it is a container that runs already, and is never started.
        host: The host that it runs on; empty if the file names none.
    """

    name: str
    description: str
    command: tuple[str, ...]
    package: str | None
    executable: str | None
    launch: str | None
    arguments: tuple[str, ...]
    node_name: str | None
    namespace: str | None
    parameters: Mapping[str, Any]
    parameter_files: tuple[ParameterFileSpec, ...]
    remap: tuple[tuple[str, str], ...]
    log_level: LogLevel | None
    env: Mapping[str, str]
    cwd: str | None
    restart: RestartRule
    restart_delay_sec: float
    most_restarts: int | None
    on_exit: tuple[ExitActionSpec, ...]
    stop_signal: str
    stop_timeout_sec: float | None
    wait_for: tuple[ConditionSpec, ...]
    delay_sec: float
    on_demand: bool
    nodes: tuple[DeclaredNodeSpec, ...]
    declares_all_ends: bool
    lifecycle: DrivenState | None
    components: Mapping[str, ComponentSpec]
    external: bool
    host: str
    path: DataPath

    @property
    def full_name(self) -> str:
        """The full name of its node, if it is a container."""
        return join_names(self.namespace or '/', self.node_name or self.name)

    @property
    def named_nodes(self) -> tuple[str, ...]:
        """The full name of the node that it is told to have, if it is."""
        return (join_names(self.namespace or '/', self.node_name),) if self.node_name else ()

    @property
    def starts_late(self) -> bool:
        """Whether it waits for something, or for some time, before it starts."""
        return bool(self.wait_for or self.delay_sec)

    @property
    def is_ros(self) -> bool:
        """Whether it takes arguments for ROS: an executable of a package does."""
        given = (self.node_name, self.namespace, self.parameters, self.parameter_files)
        return self.package is not None or any((*given, self.remap, self.log_level))


@record
class NodeSpec:
    """A node and all that it has.

    A field with a default is a key of the language, read as it is.

    Attributes:
        namespace: In full, as in `/robot`.
        local_delivery: Of entities that do not say so, and are created while it runs.
        allow_undeclared_parameters: Whether others can be set than are declared.
        automatically_declare_parameters_from_overrides: Whether all are declared that parameter
            files and the command line give it.
        parameter_services: Whether others can list, read and set its parameters.
        rosout: Whether what it logs goes to `/rosout`, too.
        type_description_service: Whether it answers which types it uses.
        logger_services: Whether others can read and set its loggers' levels.
        remap: Rules, from and to; the first that matches wins.
        state: What `node.state` starts as.
        wait_for: What must be there before it starts.
        delay_sec: Time between the moment when its conditions hold and its start.
        parameter_files: In ROS's own format; later ones win.
        followed: The parameters that values of its entities, or their number, follow.
        lifecycle: The state to which a node with a lifecycle brings itself; `None` for one
            without.
        bond: Whether it keeps a bond while it is active.
        worker: The worker that it runs in; empty for the process of the system.
        host: The host that it runs on, also if only its worker says so; empty if the file names
            none.
    """

    _: KW_ONLY
    name: str
    namespace: str
    description: str = ''
    log_level: LogLevel | None = None
    use_sim_time: bool = False
    local_delivery: bool = True
    allow_undeclared_parameters: bool = False
    automatically_declare_parameters_from_overrides: bool = False
    parameter_services: bool = True
    rosout: bool = True
    type_description_service: bool = False
    logger_services: bool = False
    bond: bool = False
    worker: str = ''
    host: str = ''
    on_error: OnError
    warn_after_sec: float | None
    parameters: Mapping[str, ParameterSpec]
    state: Mapping[str, Any]
    remap: tuple[tuple[str, str], ...]
    publishers: Mapping[str, PublisherSpec]
    subscriptions: Mapping[str, SubscriptionSpec]
    timers: Mapping[str, TimerSpec]
    sources: Mapping[str, SourceSpec]
    services: Mapping[str, ServiceSpec]
    service_clients: Mapping[str, ServiceClientSpec]
    actions: Mapping[str, ActionSpec]
    action_clients: Mapping[str, ActionClientSpec]
    on_start: BehaviourSpec | None
    on_stop: BehaviourSpec | None
    before_parameters_set: BehaviourSpec | None
    on_parameters: BehaviourSpec | None
    after_parameters_set: BehaviourSpec | None
    lifecycle: LifecycleStart | None
    on_configure: BehaviourSpec | None
    on_activate: BehaviourSpec | None
    on_deactivate: BehaviourSpec | None
    on_cleanup: BehaviourSpec | None
    on_error_state: BehaviourSpec | None
    wait_for: tuple[ConditionSpec, ...]
    delay_sec: float
    parameter_files: tuple[ParameterFileSpec, ...]
    followed: tuple[str, ...]
    path: DataPath

    @property
    def starts_late(self) -> bool:
        """Whether it waits for something, or for some time, before it starts."""
        return bool(self.wait_for or self.delay_sec)

    @property
    def key(self) -> str:
        """Its key in the file: its name, or its full name."""
        return str(self.path[-1])

    @property
    def has_other_parameters(self) -> bool:
        """Whether it may have parameters that the file does not declare."""
        return (
            self.allow_undeclared_parameters
            or self.automatically_declare_parameters_from_overrides
        )

    @property
    def full_name(self) -> str:
        """Its name in its namespace, as in `/robot/arm`."""
        return join_names(self.namespace, self.name)

    def entities(self) -> Iterator[tuple[EntityKind, EntitySpec]]:
        """Yield all that the node has, each with its kind."""
        for kind in ENTITY_KINDS:
            for entity in getattr(self, kind.section).values():
                yield kind, entity

    def ends(self) -> Iterator[tuple[EntityKind, EndSpec]]:
        """Yield all that meets others on a topic, service or action, each with its kind."""
        for kind in CHANNEL_KINDS:
            for entity in getattr(self, kind.section).values():
                yield kind, entity

    @property
    def triggers(self) -> list[Any]:
        """All that may publish what a behaviour returns: what has the key `publish`."""
        return [each for kind in ENTITY_KINDS if kind.publishes for each in self._of(kind)]

    @property
    def grouped(self) -> list[Any]:
        """All whose behaviours run in a callback group: what has the key `group`."""
        return [each for kind in ENTITY_KINDS if kind.has_group for each in self._of(kind)]

    def _of(self, kind: EntityKind) -> Iterable[Any]:
        entities: Mapping[str, Any] = getattr(self, kind.section)
        return entities.values()


@record
class WorkerSpec:
    """A process of the system in which some of its nodes run.

    Attributes:
        cpus: The processor cores that it may use; empty for all.
        nice: What is added to the niceness of the system; `None` for nothing.
        threads: How many callbacks may run at the same time; `None` as for the system.
        environment: Environment variables beside those of the system.
        restart: When it is started again.
        most_restarts: How many times; `None` for no end.
        required: Whether its end for good ends the system.
        host: The host that it runs on, also if only its nodes say so; empty for none.
        log_level: The level of its nodes that have none of their own.
        path: Where it is declared; where it is named first if it is not.
    """

    name: str
    description: str
    cpus: tuple[int, ...]
    nice: int | None
    threads: int | None
    environment: Mapping[str, str]
    restart: RestartRule
    restart_delay_sec: float
    most_restarts: int | None
    required: bool
    host: str
    log_level: LogLevel | None
    path: DataPath


@record
class HostSpec:
    """A computer that parts of the system run on.

    Attributes:
        address: An address, or a name that ssh knows.
        user: Who logs in; empty as ssh has it.
        port: Of ssh; `None` as ssh has it.
        python: The interpreter there.
        identity_file: A private key; empty as ssh has it.
        folder: Where what is brought there lies.
        systemd: Which service manager runs its part.
    """

    name: str
    description: str
    address: str
    user: str
    port: int | None
    python: str
    identity_file: str
    folder: str
    systemd: Literal['user', 'system']
    path: DataPath


@record
class NetworkSpec:
    """How the processes of the system find each other.

    Attributes:
        domain_id: The ROS domain; `None` for that of the environment.
        peers: Addresses to look at beside those of the hosts.
        server: The host of the discovery server, or of the Zenoh router; empty for none.
        port: Of the server.
    """

    discovery: Discovery
    domain_id: int | None
    peers: tuple[str, ...]
    server: str
    port: int
    path: DataPath


@record
class SystemSpec:
    """A whole system, or the part of it that one host or one worker runs.

    Attributes:
        name: The file's name without its ending.
        interfaces: The folders of interface packages to build if they are not installed.
        listed_interfaces: What alone is built of a package, as in `msg/Name`, with the messages
            that it uses; packages that are not here are built whole.
        qos: The named profiles of the file.
        threads: How many callbacks may run at the same time; `None` for as many as block.
        shutdown_timeout_sec: What running callbacks get to end when the system stops.
        environment: Environment variables that are set before ROS starts.
        nodes: By their keys in the file: the name, or the full name.
        diagnostics_period_sec: Time between two messages on `/diagnostics`; `None` for none.
        workers: By name, also those that are only named by nodes.
        network: `None` if the file says nothing of it.
        host: The host whose part this is; empty for the whole system.
    """

    name: str
    description: str
    interfaces: Mapping[str, str]
    listed_interfaces: Mapping[str, tuple[str, ...]]
    qos: Mapping[str, QosSpec]
    threads: int | None
    shutdown_timeout_sec: float
    environment: Mapping[str, str]
    diagnostics_period_sec: float | None
    nodes: Mapping[str, NodeSpec]
    processes: Mapping[str, ProcessSpec]
    workers: Mapping[str, WorkerSpec]
    hosts: Mapping[str, HostSpec]
    network: NetworkSpec | None
    host: str = ''

    @property
    def running_name(self) -> str:
        """Its name where systems that run are listed: parts have that of their host in it."""
        return f'{self.name}@{self.host}' if self.host else self.name

    def on_host(self, name: str) -> SystemSpec:
        """Return the part of the system that runs on a host."""
        return replace(
            self,
            nodes=_only(self.nodes, lambda each: each.host == name),
            processes=_only(self.processes, lambda each: each.host == name),
            workers=_only(self.workers, lambda each: each.host == name),
            host=name,
        )

    def in_worker(self, name: str) -> SystemSpec:
        """Return the part of the system that runs in a worker.

        Args:
            name: `''` for the process of the system, which has the external processes, and all
                workers, too.
        """
        nodes = _only(self.nodes, lambda each: each.worker == name)
        if not name:
            return replace(self, nodes=nodes)
        workers = _only(self.workers, lambda each: each.name == name)
        return replace(self, nodes=nodes, workers=workers, processes=MappingProxyType({}))

    def nodes_named(self, name: str) -> list[str]:
        """Return the full names of the nodes that a name means: a node's, or a worker's."""
        named = [node for key, node in self.nodes.items() if name in (key, node.full_name)]
        inside = [node for node in self.nodes.values() if name and node.worker == name]
        return [node.full_name for node in named or inside]

    def end_owners(self) -> Iterator[NodeSpec | DeclaredNodeSpec]:
        """Yield the nodes, and those that external processes are said to have."""
        yield from self.nodes.values()
        for process in self.processes.values():
            yield from process.nodes

    @property
    def components(self) -> Iterator[ComponentSpec]:
        """All components of its containers."""
        for process in self.processes.values():
            yield from process.components.values()

    @property
    def without_parameter_services(self) -> frozenset[str]:
        """The full names of the nodes whose parameters others cannot read and set."""
        return frozenset(
            node.full_name for node in self.nodes.values() if not node.parameter_services
        )

    @property
    def longest_stop_sec(self) -> float:
        """The longest time that callbacks, and then processes, get to end at the stop."""
        own = self.shutdown_timeout_sec
        given = [process.stop_timeout_sec for process in self.processes.values()]
        return own + max((own if each is None else each for each in given), default=0.0)


def _only(specs: Mapping[str, SpecT], is_wanted: Callable[[SpecT], bool]) -> Mapping[str, SpecT]:
    return MappingProxyType({name: each for name, each in specs.items() if is_wanted(each)})
