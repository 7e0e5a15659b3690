"""A running node: the rclpy node, its entities, and what these share."""

from __future__ import annotations

import copy
import threading
from collections import defaultdict
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle

from composer.entity_kinds import ENTITY_KINDS
from composer.errors import StartError, SystemStoppingError
from composer.language.bindings import node_bindings
from composer.language.specs import REENTRANT
from composer.runtime.behaviours.callables import Method, make_instance
from composer.runtime.behaviours.calls import FAILED, BehaviourCall, discard_result
from composer.runtime.behaviours.error_reports import ErrorReporter
from composer.runtime.behaviours.running_calls import Owner, RunningCalls
from composer.runtime.behaviours.tracebacks import format_behaviour_error, summarize
from composer.runtime.behaviours.waits import Waits
from composer.runtime.health.hangs import HangLimit
from composer.runtime.health.missed import count_missed
from composer.runtime.lifecycle.lifecycle_node import LifecycleRosNode
from composer.runtime.messages.ownership import UNHELD_RESULT
from composer.runtime.nodes.behaviour_node import Node
from composer.runtime.nodes.callback_groups import (
    EventGroup,
    Gate,
    GatedMutuallyExclusiveGroup,
    GatedReentrantGroup,
    LifecycleGate,
)
from composer.runtime.nodes.created_entities import EntityCreation
from composer.runtime.nodes.qos_overrides import QosOverrides
from composer.runtime.nodes.remote_parameters import RemoteParameters
from composer.runtime.nodes.ros_node import ComposedRosNode
from composer.runtime.reserved_methods import release, reserve

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from rclpy.callback_groups import CallbackGroup
    from rclpy.task import Future

    from composer.executor.sources.inbox import Inbox
    from composer.language.specs import BehaviourSpec, EntitySpec, NodeSpec
    from composer.runtime.health.statistics import EntityHealth
    from composer.runtime.health.unmatched import TopicEndpoint
    from composer.runtime.nodes.live_entity import (
        BehaviourOptions,
        LiveEntity,
        NodeLifecycle,
        NodeParameters,
        Suspended,
    )
    from composer.runtime.nodes.system_handle import SystemHandle
    from composer.yaml_text.positions import DataPath


@dataclass(slots=True)
class LiveNode:
    """A node with what its entities share.

    Attributes:
        entities: Its entities as behaviours use them, by section and name.
        gate: Closed until the node has started, and when it stops.
        has_begun: Whether `on_start` has been called, so that `on_stop` has something to stop.
        waits: How its behaviours wait.
        background: A callback group without behaviours: its responses are always taken.
        events: The callback group of its publishers' events.
        serving: The callback group of requests to action servers.
        functions: The behaviours, by their names, as they were when the node was created or
            changed: one that goes calls those that it has known.
        overrides: The parameters that override the QoS of its publishers and subscriptions.
        created: The behaviours of entities that other behaviours have created, by their names.
        at_destruction: What ends entities that rclpy's node does not end itself.
        endpoints: Its publishers and subscriptions.
        counted: The health of those of its entities that may miss something.
        suspended: Behaviours that are ended before `on_stop`.
        limits: How long behaviours may run, by their owners.
        parameters: Its declared parameters, once its entities are created.
        lifecycle: Its lifecycle; `None` for a node without.
        remote_parameters: Gets and sets those of other nodes.
        owners: The classes of its instances, by `module:Class`.
        full_name: Its name with its namespace.
    """

    spec: NodeSpec
    system: SystemHandle
    ros: ComposedRosNode
    behaviour_node: Node
    errors: ErrorReporter
    entities: defaultdict[str, dict[str, LiveEntity]]
    waits: Waits
    background: CallbackGroup
    events: CallbackGroup
    gate: Gate
    serving: CallbackGroup
    functions: Mapping[str, Callable[..., Any]]
    overrides: QosOverrides
    remote_parameters: RemoteParameters
    created: dict[str, Callable[..., Any]] = field(default_factory=dict)
    at_destruction: list[Callable[[], None]] = field(default_factory=list)
    endpoints: list[TopicEndpoint] = field(default_factory=list)
    counted: dict[Owner, EntityHealth] = field(default_factory=dict)
    suspended: list[Suspended] = field(default_factory=list)
    limits: dict[Owner, HangLimit] = field(default_factory=dict)
    running: RunningCalls = field(default_factory=RunningCalls)
    has_begun: bool = False
    parameters: NodeParameters | None = None
    lifecycle: NodeLifecycle | None = None
    _groups: dict[str, CallbackGroup] = field(default_factory=dict)
    _views: dict[Owner, Node] = field(default_factory=dict)
    owners: dict[str, type] = field(default_factory=dict)
    _instances: dict[type, Any] = field(default_factory=dict)
    full_name: str = field(init=False)
    _is_destroyed: bool = False

    def __post_init__(self) -> None:
        """Keep its name with its namespace: others ask for it when it is gone."""
        self.full_name = str(self.ros.get_fully_qualified_name())
        self.running.node = self.waits.node = self.full_name

    def group(self, name: str | None) -> CallbackGroup:
        """Return the callback group of this name; `None` is the node's own."""
        key = name or ''
        if key not in self._groups:
            kind = GatedReentrantGroup if key == REENTRANT else GatedMutuallyExclusiveGroup
            self._groups[key] = kind(self.gate)
        return self._groups[key]

    def place(self, path: DataPath) -> str:
        """Return `file:line` of a place in the file, as it is now."""
        return self.system.positions.key(path).place

    def placing(self, spec: EntitySpec) -> Callable[[], str]:
        """Return what tells where an entity is declared: an edit may move it."""
        return partial(self.place, spec.path)

    def bind(self, behaviour: BehaviourSpec, owner: Owner | None = None) -> Callable[..., Any]:
        """Return the function of a behaviour with the node and its constant arguments given.

        Args:
            owner: The entity whose `own_state` it has; `None` for one without.
        """
        node = self.behaviour_node
        if owner is not None:
            node = self._views.setdefault(owner, node.with_own_state())
        function = self.function_of(behaviour)
        if isinstance(function, Method):
            # An edit beside the class made a new one, too: the node keeps that of its instance.
            kept = self.owners.setdefault(class_of(behaviour), function.owner)
            function = function.of(self._instance(kept))
        return partial(function, node, **behaviour.arguments)

    def function_of(self, behaviour: BehaviourSpec) -> Callable[..., Any]:
        """Return the function of a behaviour: of the files, or one that a behaviour has given."""
        return self.created.get(behaviour.name) or self.functions[behaviour.name]

    def options(self) -> dict[str, Any]:
        """Return what holds for entities that do not say otherwise, as keys of the node."""
        spec = self.spec
        return {
            'on_error': spec.on_error,
            'warn_after': spec.warn_after_sec,
            'local_delivery': spec.local_delivery,
        }

    def make_instances(self) -> None:
        """Make an instance of each class whose methods are behaviours of the node."""
        for binding in node_bindings(self.spec):
            method = self.functions[binding.behaviour.name]
            if isinstance(method, Method):
                owner = self.owners.setdefault(class_of(binding.behaviour), method.owner)
                self._instance(owner)

    def _instance(self, owner: type) -> Any:
        """Return the node's instance of a class; it is made with the first that needs it."""
        if owner not in self._instances:
            try:
                self._instances[owner] = make_instance(owner, self.behaviour_node)
            except Exception as error:
                message = f'{owner.__qualname__}.__init__ raised {summarize(error)}'
                raise StartError(message) from error
        return self._instances[owner]

    def call(
        self,
        owner: Owner,
        path: DataPath,
        function: Callable[..., Any],
        *,
        options: BehaviourOptions | None = None,
        deliver: Callable[[Any], Any] = discard_result,
        may_begin: Callable[[], bool] | None = None,
    ) -> BehaviourCall:
        """Return the call of a function that an entity is bound to.

        Args:
            path: Its place in the file.
            options: Those of the entity, if it has its own.
            deliver: Takes what the function returns.
            may_begin: See `BehaviourCall`.
        """
        own = options or self.spec
        self._limit(owner, path, own)
        health = self._health(owner)

        def failed(owner: Owner, error: BaseException) -> None:
            if isinstance(error, SystemStoppingError):
                return
            health.note_error(error)
            self._tell_error(owner, error)
            self.errors.report(f'{owner} ({self.place(path)})', error)
            self.system.act_on_error(self.spec.full_name, own.on_error)

        return BehaviourCall(
            owner,
            function,
            self.running,
            deliver=deliver,
            failed=failed,
            # Who observes does so in virtual time, which calls do not take.
            add_time=None if self.system.observe else health.times.add,
            may_begin=self._observed(owner, may_begin),
        )

    def reported_call(
        self,
        owner: Owner,
        path: DataPath,
        function: Callable[..., Any],
        failed: Callable[[BaseException], None] | None = None,
        deliver: Callable[[Any], Any] = discard_result,
    ) -> BehaviourCall:
        """Return the call of a function whose errors are reported, and no more.

        At the start and the end of a node `on_error` does not count.

        Args:
            failed: Takes what it raised, after that has been reported.
            deliver: Takes what it returned.
        """
        if owner not in self.limits:
            self._limit(owner, path, self.spec)

        def report(owner: Owner, error: BaseException) -> None:
            if isinstance(error, SystemStoppingError):
                return
            self._tell_error(owner, error)
            self.errors.report(f'{owner} ({self.place(path)})', error)
            if failed is not None:
                failed(error)

        may_begin = self._observed(owner, None)
        return BehaviourCall(
            owner, function, self.running, deliver=deliver, failed=report, may_begin=may_begin
        )

    def _observed(
        self, owner: Owner, may_begin: Callable[[], bool] | None
    ) -> Callable[[], bool] | None:
        """Return what tells whether a call may begin, and that it does, if somebody observes."""
        observe = self.system.observe
        if observe is None:
            return may_begin
        name, what = self.full_name, str(owner)

        def begin() -> bool:
            may_call = may_begin is None or may_begin()
            if may_call:
                observe('callback', name, what, None)
            return may_call

        return begin

    def _tell_error(self, owner: Owner, error: BaseException) -> None:
        if self.system.observe is not None:
            text = f'{summarize(error)}\n{format_behaviour_error(error)}'.rstrip()
            self.system.observe('error', self.full_name, str(owner), text)

    def serve_at_once(self) -> None:
        """Answer requests from now on, if the node has nothing to do before."""
        spec = self.spec
        if spec.on_start or spec.starts_late or spec.lifecycle not in (None, 'unconfigured'):
            return
        self.gate.serves = True
        if self.lifecycle:
            self.lifecycle.begin()

    def begin(self, call: BehaviourCall, *arguments: Any) -> tuple[Future, threading.Event]:
        """Run a behaviour in the executor.

        Returns:
            The future of what `call.run` returns, and an event that is set when it is done.
        """
        ended = threading.Event()
        task = self.system.executor.create_task(call.run, *arguments)
        task.add_done_callback(lambda _task: ended.set())
        return task, ended

    def run_to_end(
        self, call: BehaviourCall, *arguments: Any, timeout_sec: float | None = None
    ) -> Any:
        """Run a behaviour here, or in the executor if it is a coroutine, and wait for its end.

        Args:
            timeout_sec: How long to wait for a coroutine; `None` for no limit.

        Returns:
            What `call.run` returns; `FAILED` for a coroutine that did not end in time.
        """
        if not call.is_async:
            return call.run(*arguments)
        task, ended = self.begin(call, *arguments)
        with self.waits.make_room():
            return task.result() if ended.wait(timeout_sec) else FAILED

    def publish_to(self, publisher: str | None) -> Callable[[Any], None]:
        """Return what publishes results on a publisher, but for `None`; without one, nothing."""
        if publisher is None:
            return discard_result
        publishers: dict[str, Any] = self.entities['publishers']

        def publish_result(payload: Any) -> None:
            # Looked up each time: an edit may put another one in its place, or remove it while a
            # behaviour runs for long.
            if payload is not None and (end := publishers.get(publisher)) is not None:
                end.publish(payload, UNHELD_RESULT)

        return publish_result

    def count_missed(self, owner: Owner, entity: Any, inbox: Inbox | None = None) -> None:
        """Count in the health of an entity what its ROS entity, and its inbox, have missed."""
        counter = count_missed(self.system.executor, self.ros, entity, inbox, str(owner))
        counter.node = self.full_name
        health = self.counted[owner] = self._health(owner)
        health.follow(counter, counter.queued, counter.deliveries)
        health.rest(rests=self.gate.rests)

    def rest_counts(self, *, rests: bool) -> None:
        """Count nothing that is missed from now on, as its lifecycle is not active; or count."""
        for health in list(self.counted.values()):
            health.rest(rests=rests)

    def timers(self) -> Iterator[Any]:
        """Yield the rclpy timers that call behaviours."""
        for kind in ENTITY_KINDS:
            if kind.is_timed:
                timers: dict[str, Any] = self.entities.get(kind.section, {})
                yield from (timer.ros for timer in list(timers.values()))

    def flush_counts(self) -> None:
        """Log the counts of what has not been logged."""
        self.errors.flush()
        for end in list(self.endpoints):
            end.losses.flush()

    def change(self, noun: str, spec: Any, entity: LiveEntity) -> None:
        """Let an entity do as `spec` says from now on."""
        self.drop_limits(noun, spec.name)
        entity.change(spec)

    def limits_of(self, noun: str, name: str) -> dict[Owner, HangLimit]:
        """Return how long behaviours of an entity may run."""
        whose = (noun, name)
        return {
            owner: limit
            for owner, limit in self.limits.items()
            if (owner.kind, owner.name) == whose
        }

    def drop_limits(self, noun: str, name: str = '') -> None:
        """Forget how long behaviours of an entity, or of the node itself, may run."""
        _drop(self.limits, noun, name)

    def forget(self, noun: str, name: str) -> None:
        """Forget what is known of an entity that is gone: its limits and `own_state`."""
        self.drop_limits(noun, name)
        _drop(self._views, noun, name)

    def take_over(self, old: LiveNode) -> None:
        """Begin where a node that was the same ended: with its state and parameters."""
        vars(self.behaviour_node.state).update(vars(old.behaviour_node.state))
        for owner, view in old._views.items():
            self._views[owner].own_state = view.own_state
        for name in self.spec.parameters:
            self.ros.put_parameter(*old.ros.copy_parameter(name))
        if self.parameters and old.parameters:
            self.parameters.set_live |= old.parameters.set_live

    def lose_servers(self) -> None:
        """End the calls and goals that wait for servers that were killed."""
        for section in ('service_clients', 'action_clients'):
            clients: dict[str, Any] = self.entities[section]
            for client in list(clients.values()):
                client.lose_server()
        self.remote_parameters.lose_servers()

    def check_servers(self) -> None:
        """End the goals whose servers have left the graph."""
        clients: dict[str, Any] = self.entities['action_clients']
        for client in list(clients.values()):
            client.check_servers()

    def destroy(self) -> None:
        """Remove the node and all its entities from the graph; a second time does nothing."""
        if self._is_destroyed:
            return
        self._is_destroyed = True
        self.flush_counts()
        # Some take themselves out of it.
        for end in list(self.at_destruction):
            with suppress(InvalidHandle):
                # A behaviour may have destroyed it.
                end()
        self.system.topics.forget(self.ros)
        self.system.services.forget(self.ros)
        release(self.ros)
        self.ros.destroy_node()

    def _health(self, owner: Owner) -> EntityHealth:
        """Return the health of an entity."""
        return self.system.health.entity(self.full_name, owner)

    def _limit(self, owner: Owner, path: DataPath, options: BehaviourOptions) -> None:
        warn = self.ros.get_logger().warning
        place = partial(self.place, path)
        self.limits[owner] = HangLimit(owner, place, options.warn_after_sec, warn)


def _drop(by_owner: dict[Owner, Any], noun: str, name: str) -> None:
    for owner in list(by_owner):
        if (owner.kind, owner.name) == (noun, name):
            del by_owner[owner]


def create_live_node(spec: NodeSpec, system: SystemHandle) -> LiveNode:
    """Create a node without entities."""
    entries = system.parameter_files.get(spec.full_name, {})
    kind = LifecycleRosNode if spec.lifecycle else ComposedRosNode
    ros = kind(spec, system.context, system.ros_arguments, entries)
    ros.lost = system.lost
    reserve(ros, 'the node', 'destroy_node')
    entities: defaultdict[str, dict[str, LiveEntity]] = defaultdict(dict)
    background = ReentrantCallbackGroup()
    gate = LifecycleGate(system.stop) if spec.lifecycle else Gate(system.stop)
    waits = Waits(system.executor, system.stop)
    state = SimpleNamespace()
    state.__dict__.update(copy.deepcopy(dict(spec.state)))
    remote_parameters = RemoteParameters(
        ros, spec.namespace, waits, background, system.without_parameter_services
    )
    creation = EntityCreation()
    live = LiveNode(
        spec,
        system,
        ros,
        behaviour_node=Node(ros, state, entities, remote_parameters, system.shutdown, creation),
        errors=ErrorReporter(ros.get_logger().error),
        entities=entities,
        waits=waits,
        background=background,
        events=EventGroup(),
        gate=gate,
        serving=GatedMutuallyExclusiveGroup(gate),
        functions=system.functions,
        overrides=QosOverrides(ros),
        remote_parameters=remote_parameters,
    )
    creation.node = live
    if (observe := system.observe) is not None:
        name = live.full_name

        def tell(parameters: list[Any]) -> None:
            for each in parameters:
                observe('parameter', name, each.name, each.value)

        ros.add_post_set_parameters_callback(tell)
    return live


def class_of(behaviour: BehaviourSpec) -> str:
    """Return `module:Class` of a behaviour that is a method."""
    return f'{behaviour.module}:{behaviour.class_name}'
