"""Subscriptions: each message goes to a behaviour, or is published again as it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.qos import DurabilityPolicy

from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.calls import return_result
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.health.unmatched import TopicEndpoint
from composer.runtime.messages.qos_profiles import create_qos_profile
from composer.runtime.messages.read_only import protector_for
from composer.runtime.nodes.callback_groups import LifecycleGate

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import SubscriptionSpec
    from composer.runtime.behaviours.calls import BehaviourCall
    from composer.runtime.nodes.callback_groups import Gate
    from composer.runtime.nodes.live_node import LiveNode


class Subscription:
    """A subscription."""

    def __init__(self, node: LiveNode, spec: SubscriptionSpec) -> None:
        self._node = node
        self._owner = Owner('subscription', spec.name)
        profile = create_qos_profile(spec.qos, node.system.profiles)
        self._endpoint = TopicEndpoint(node.ros, 'subscription', spec, profile, node.placing(spec))
        self._ros = node.ros.create_subscription(
            import_interface(spec.type),
            spec.topic,
            self._create_callback(spec),
            profile,
            callback_group=node.group(spec.group),
            event_callbacks=self._endpoint.subscription_events(),
        )
        node.endpoints.append(self._endpoint)
        self._rest(spec)
        self._local = node.system.topics.add_subscription(
            node.ros, self._ros, read_only=spec.read_only
        )
        node.count_missed(self._owner, self._ros, self._local.inbox)

    def change(self, spec: SubscriptionSpec) -> None:
        """See `LiveEntity`."""
        topics = self._node.system.topics
        topics.change_subscription(self._local, read_only=spec.read_only)
        self._rest(spec)
        self._ros.callback = self._create_callback(spec)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self._node.endpoints.remove(self._endpoint)
        self._node.system.topics.remove_subscription(self._local)
        self._node.ros.destroy_subscription(self._ros)

    def _rest(self, spec: SubscriptionSpec) -> None:
        """Have messages kept or dropped while the node is not active."""
        gate = self._node.gate
        if isinstance(gate, LifecycleGate):
            # What is latched is meant for those who come later.
            latched = self._ros.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
            fitting = 'keep' if latched else 'drop'
            gate.drop(self._ros, is_dropped=(spec.while_inactive or fitting) == 'drop')

    def _create_callback(self, spec: SubscriptionSpec) -> Callable[..., Any]:
        node, behaviour = self._node, spec.behaviour
        call = node.call(
            self._owner,
            spec.path,
            return_result if behaviour is None else node.bind(behaviour, self._owner),
            options=spec,
            deliver=node.publish_to(spec.publish),
            may_begin=node.gate.allows_events,
        )
        protect = protector_for(import_interface(spec.type)) if spec.read_only else None
        run = call.run if protect is None else _protecting(protect, call)
        return run if node.lifecycle is None else _resting(node.gate, run, call)


def _resting(gate: Gate, run: Callable[..., Any], call: BehaviourCall) -> Callable[..., Any]:
    """Return a callback that drops messages while the node is not active."""

    def receive(message: Any) -> Any:
        return None if gate.rests else run(message)

    async def receive_async(message: Any) -> Any:
        return None if gate.rests else await run(message)

    return receive_async if call.is_async else receive


def _protecting(protect: Callable[[Any], None], call: BehaviourCall) -> Callable[[Any], Any]:
    """Return a callback that gets messages without leave to write to their NumPy arrays."""

    def receive(message: Any) -> Any:
        protect(message)
        return call.run(message)

    async def receive_async(message: Any) -> Any:
        protect(message)
        return await call.run(message)

    return receive_async if call.is_async else receive
