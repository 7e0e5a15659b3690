"""Subscriptions: each message goes to a behaviour, or is published again as it is."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from rclpy.qos import DurabilityPolicy

from composer.errors import StartError
from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.calls import return_result
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.entities.event_behaviours import EventBehaviours, events_of
from composer.runtime.health.unmatched import TopicEndpoint
from composer.runtime.messages.read_only import protector_for
from composer.runtime.nodes.callback_groups import LifecycleGate

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import SubscriptionSpec
    from composer.runtime.behaviours.calls import BehaviourCall
    from composer.runtime.nodes.callback_groups import Gate
    from composer.runtime.nodes.live_node import LiveNode


class Subscription:
    """A subscription.

    Attributes:
        ros: The rclpy subscription.
        events: Its behaviours for QoS events.
        predecessor: The subscription of the same messages in whose place it comes, until
            `take_over`.
    """

    def __init__(self, node: LiveNode, spec: SubscriptionSpec) -> None:
        self._node, self._spec = node, spec
        self._owner = Owner('subscription', spec.name)
        profile = node.overrides.profile(spec, node.system.profiles, publishes=False)
        self._endpoint = TopicEndpoint(node.ros, 'subscription', spec, profile, node.placing(spec))
        self.events = EventBehaviours(node, 'subscription', spec.name)
        self.ros = node.ros.create_subscription(
            import_interface(spec.type),
            spec.topic,
            self._create_callback(spec),
            profile,
            callback_group=node.group(spec.group),
            event_callbacks=self._endpoint.subscription_events(
                self.events.callbacks(events_of(spec))
            ),
            raw=spec.raw,
            **_filter_options(spec),
        )
        node.endpoints.append(self._endpoint)
        self.predecessor = self._find_predecessor(spec)
        self._rest(spec)
        self._local = node.system.topics.add_subscription(
            node.ros,
            self.ros,
            read_only=spec.read_only,
            reason=_why_sent(spec),
            waits=self.predecessor is not None,
            what=str(self._owner),
        )
        self.events.change(events_of(spec), spec)
        if self.predecessor is None:
            node.count_missed(self._owner, self.ros, self._local.inbox)

    def _find_predecessor(self, spec: SubscriptionSpec) -> Subscription | None:
        before = self._node.entities['subscriptions'].get(spec.name)
        if not isinstance(before, Subscription):
            return None
        mine, its = self.ros, before.ros
        is_same = (
            (mine.topic_name, mine.msg_type, mine.raw) == (its.topic_name, its.msg_type, its.raw)
            and spec.content_filter == before._spec.content_filter  # noqa: SLF001 (of this class)
        )
        return before if is_same else None

    def take_over(self) -> None:
        """Get what waits for the predecessor, once and in order, and destroy it.

        No callback of either may begin meanwhile.
        """
        before, self.predecessor = self.predecessor, None
        assert before is not None  # noqa: S101 - who calls this has seen it
        self._node.system.topics.replace_subscription(before._local, self._local, before._end)  # noqa: SLF001
        self._node.count_missed(self._owner, self.ros, self._local.inbox)

    def change(self, spec: SubscriptionSpec) -> None:
        """See `LiveEntity`."""
        topics = self._node.system.topics
        topics.change_subscription(self._local, read_only=spec.read_only)
        self._rest(spec)
        self.ros.callback = self._create_callback(spec)
        self.events.change(events_of(spec), spec)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self._node.system.topics.remove_subscription(self._local)
        self._end()

    def _end(self) -> None:
        self.events.destroy()
        self._node.endpoints.remove(self._endpoint)
        self._node.overrides.drop(self._spec, publishes=False)
        self._node.ros.destroy_subscription(self.ros)

    def _rest(self, spec: SubscriptionSpec) -> None:
        """Have messages kept or dropped while the node is not active."""
        gate = self._node.gate
        if isinstance(gate, LifecycleGate):
            # What is latched is meant for those who come later.
            latched = self.ros.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
            fitting = 'keep' if latched else 'drop'
            gate.drop(self.ros, is_dropped=(spec.while_inactive or fitting) == 'drop')

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
        protect = (
            protector_for(import_interface(spec.type)) if spec.read_only and not spec.raw else None
        )
        run = call.run if protect is None else _protecting(protect, call)
        return run if node.lifecycle is None else _resting(node.gate, run, call)


def _resting(gate: Gate, run: Callable[..., Any], call: BehaviourCall) -> Callable[..., Any]:
    """Return a callback that drops messages while the node is not active."""

    def receive(message: Any) -> Any:
        return None if gate.rests else run(message)

    async def receive_async(message: Any) -> Any:
        return None if gate.rests else await run(message)

    return receive_async if call.is_async else receive


def _why_sent(spec: SubscriptionSpec) -> str:
    """Return why its messages must come from the middleware; empty if they need not."""
    return 'raw' if spec.raw else 'content_filter' if spec.content_filter else ''


def _filter_options(spec: SubscriptionSpec) -> dict[str, Any]:
    """Return the arguments of rclpy for a content filter.

    Raises:
        StartError: This rclpy has none.
    """
    if not spec.content_filter:
        return {}
    try:
        # Of rclpy 9; mypy knows one of both.
        module = importlib.import_module('rclpy.subscription_content_filter_options')
    except ImportError as error:
        message = f"the content_filter of subscription '{spec.name}' needs a newer ROS 2"
        raise StartError(message, help='rclpy has it since ROS 2 Kilted') from error
    parameters = [str(each) for each in spec.content_filter.get('parameters', ())]
    options = module.ContentFilterOptions(spec.content_filter['expression'], parameters)
    return {'content_filter_options': options}


def _protecting(protect: Callable[[Any], None], call: BehaviourCall) -> Callable[[Any], Any]:
    """Return a callback that gets messages without leave to write to their arrays of numbers."""

    def receive(message: Any) -> Any:
        protect(message)
        return call.run(message)

    async def receive_async(message: Any) -> Any:
        protect(message)
        return await call.run(message)

    return receive_async if call.is_async else receive
