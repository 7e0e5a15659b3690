"""A node while it lives: the rclpy node, its entities, and what they share."""

from __future__ import annotations

import copy
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Protocol

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle

from composer.entity_kinds import ENTITY_KINDS
from composer.errors import SystemStoppingError
from composer.language.specs import REENTRANT
from composer.runtime.behaviours.calls import BehaviourCall, CallLedger, Owner
from composer.runtime.behaviours.error_reports import ErrorReporter
from composer.runtime.behaviours.waits import CoroutineWaits, ThreadWaits
from composer.runtime.health.hangs import HangLimit
from composer.runtime.nodes.behaviour_node import Node
from composer.runtime.nodes.callback_groups import (
    Gate,
    GatedMutuallyExclusiveGroup,
    GatedReentrantGroup,
)
from composer.runtime.nodes.remote_parameters import RemoteParameters
from composer.runtime.nodes.ros_node import ComposedRosNode
from composer.runtime.reserved_methods import release, reserve

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.callback_groups import CallbackGroup
    from rclpy.timer import Timer

    from composer.language.specs import BehaviourSpec, NodeSpec, OnError
    from composer.runtime.health.statistics import EntityHealth
    from composer.runtime.health.unmatched import TopicEndpoint
    from composer.runtime.nodes.system_handle import SystemHandle
    from composer.yaml_text.positions import DataPath


class AtStop(Protocol):
    """A behaviour that has begun, and waits half-way for its next turn."""

    def close(self, timeout_sec: float) -> None:
        """Let it end; what it raises is reported."""


class Rules(Protocol):
    """What the file says about the behaviours of an entity, or of a node."""

    @property
    def on_error(self) -> OnError:
        """What is done when one raises."""

    @property
    def warn_after_sec(self) -> float | None:
        """How long one may run before that is reported."""


@dataclass(slots=True)
class LiveNode:
    """A node with what its entities share.

    Attributes:
        gate: Closed until the node has started, and when it stops.
        entities: What behaviours use by name, by the section of its kind.
        has_begun: Whether its turn to start has come, so that `on_stop` has something to stop.
        waits: How its plain functions wait; `coroutine_waits` is for coroutines.
        background: A group that no behaviour is in: responses and the like are always taken.
        serving: The group of requests to action servers.
        at_destruction: What ends entities that rclpy's node does not end itself.
        endpoints: Its publishers and subscriptions.
        at_stop: Behaviours that wait half-way, to be ended before `on_stop`.
        limits: How long behaviours may run, by their owners.
    """

    spec: NodeSpec
    services: SystemHandle
    ros: ComposedRosNode
    behaviour_node: Node
    errors: ErrorReporter
    entities: dict[str, dict[str, Any]]
    waits: ThreadWaits
    coroutine_waits: CoroutineWaits
    background: CallbackGroup
    gate: Gate
    serving: CallbackGroup
    at_destruction: list[Callable[[], None]] = field(default_factory=list)
    endpoints: list[TopicEndpoint] = field(default_factory=list)
    at_stop: list[AtStop] = field(default_factory=list)
    limits: dict[Owner, HangLimit] = field(default_factory=dict)
    timers: list[Timer] = field(default_factory=list)
    ledger: CallLedger = field(default_factory=CallLedger)
    has_begun: bool = False
    _groups: dict[str, CallbackGroup] = field(default_factory=dict)
    _is_destroyed: bool = False

    def group(self, name: str | None) -> CallbackGroup:
        """Return the callback group of this name; `None` is the node's own."""
        key = name or ''
        if key not in self._groups:
            kind = GatedReentrantGroup if key == REENTRANT else GatedMutuallyExclusiveGroup
            self._groups[key] = kind(self.gate)
        return self._groups[key]

    def function(self, behaviour: BehaviourSpec) -> Callable[..., Any]:
        """Return a behaviour as a function of its positional arguments."""
        return self.services.functions[behaviour.name]

    def bind(self, behaviour: BehaviourSpec) -> Callable[..., Any]:
        """Return the function of a behaviour with the node and its constant arguments given."""
        return partial(
            self.function(behaviour), self.behaviour_node.with_own_state(), **behaviour.arguments
        )

    def health(self, owner: Owner) -> EntityHealth | None:
        """Return the health of an entity in words, `None` if it is not measured."""
        board = self.services.health
        return None if board is None else board.entity(self.full_name, owner)

    def follow(self, owner: Owner, entity: Any) -> None:
        """Let the health of an entity in words tell what its ROS entity has missed."""
        health = self.health(owner)
        if health is not None:
            health.follow(partial(self.services.executor.missed_counts, self.ros, entity))

    @property
    def full_name(self) -> str:
        """The node's name with its namespace."""
        return str(self.ros.get_fully_qualified_name())

    def call(
        self,
        owner: Owner,
        path: DataPath,
        function: Callable[..., Any],
        *,
        rules: Rules | None = None,
        publish: str | None = None,
        admits: Callable[[], bool] | None = None,
    ) -> BehaviourCall:
        """Return the wrapped call of a function that an entity is bound to.

        Args:
            path: Its place in the file.
            rules: Those of the entity, if it has its own.
            publish: The publisher that takes what the function returns.
            admits: See `BehaviourCall`.
        """
        place = self.place(path)
        own = rules or self.spec
        self._limit(owner, place, own)
        health = self.health(owner)

        def failed(owner: Owner, error: BaseException) -> None:
            if isinstance(error, SystemStoppingError):
                return
            if health is not None:
                health.note_error(error)
            self.errors.report(owner, place, error)
            self.services.act_on_error(self.spec.full_name, own.on_error)

        return BehaviourCall(
            owner,
            function,
            self.ledger,
            deliver=self._delivery(publish),
            failed=failed,
            add_time=None if health is None else health.times.add,
            admits=admits,
        )

    def hook(
        self,
        owner: Owner,
        behaviour: BehaviourSpec,
        failed: Callable[[BaseException], None] | None = None,
    ) -> BehaviourCall:
        """Return the wrapped call of `on_start` or `on_stop`, which takes the node alone.

        Args:
            failed: Takes what it raised, after that has been reported.
        """
        function = partial(self.function(behaviour), **behaviour.arguments)
        return self.reported_call(owner, behaviour.path, function, failed)

    def reported_call(
        self,
        owner: Owner,
        path: DataPath,
        function: Callable[..., Any],
        failed: Callable[[BaseException], None] | None = None,
    ) -> BehaviourCall:
        """Return the wrapped call of a function whose errors are reported, and no more.

        At the start and the end of a node `on_error` does not count.
        """
        place = self.place(path)
        self._limit(owner, place, self.spec)

        def report(owner: Owner, error: BaseException) -> None:
            if isinstance(error, SystemStoppingError):
                return
            self.errors.report(owner, place, error)
            if failed is not None:
                failed(error)

        return BehaviourCall(owner, function, self.ledger, deliver=_discard, failed=report)

    def place(self, path: DataPath) -> str:
        """Return `file:line` of a place in the file."""
        span = self.services.positions.key(path)
        return f'{span.source.name}:{span.line}'

    def destroy(self) -> None:
        """Remove the node and all its entities from the graph; a second time does nothing."""
        if self._is_destroyed:
            return
        self._is_destroyed = True
        self.errors.flush()
        for end in self.at_destruction:
            with suppress(InvalidHandle):
                # A behaviour may have destroyed it.
                end()
        release(self.ros)
        self.ros.destroy_node()

    def _limit(self, owner: Owner, place: str, rules: Rules) -> None:
        if owner not in self.limits:
            warn = self.ros.get_logger().warning
            self.limits[owner] = HangLimit(owner, place, rules.warn_after_sec, warn)

    def _delivery(self, publish: str | None) -> Callable[[Any], None]:
        if publish is None:
            return _discard
        send = self.entities['publishers'][publish]

        def deliver(payload: Any) -> None:
            if payload is not None:
                send(payload)

        return deliver


def create_live_node(spec: NodeSpec, services: SystemHandle) -> LiveNode:
    """Create a node without entities."""
    ros = ComposedRosNode(spec, services.context, services.ros_arguments)
    reserve(ros, 'the node', 'destroy_node')
    entities: dict[str, dict[str, Any]] = {kind.section: {} for kind in ENTITY_KINDS}
    background = ReentrantCallbackGroup()
    gate = Gate()
    waits = ThreadWaits(services.executor.waiting, services.stop)
    state = SimpleNamespace()
    state.__dict__.update(copy.deepcopy(dict(spec.state)))
    remote_parameters = RemoteParameters(
        ros, spec.namespace, waits, background, services.without_parameter_services
    )
    return LiveNode(
        spec,
        services,
        ros,
        behaviour_node=Node(ros, state, entities, remote_parameters, services.shutdown),
        errors=ErrorReporter(ros.get_logger().error),
        entities=entities,
        waits=waits,
        coroutine_waits=CoroutineWaits(services.executor, waits),
        background=background,
        gate=gate,
        serving=GatedMutuallyExclusiveGroup(gate),
    )


def _discard(_result: Any) -> None:
    """Take a result that goes nowhere."""
