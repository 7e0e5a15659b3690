"""Subscriptions: each message goes to a behaviour, or is published again as it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.calls import return_result
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.health.unmatched import TopicEndpoint
from composer.runtime.messages.qos_profiles import create_qos_profile

if TYPE_CHECKING:
    from composer.language.specs import SubscriptionSpec
    from composer.runtime.nodes.live_node import LiveNode


def create_subscription(node: LiveNode, spec: SubscriptionSpec) -> Any:
    """Create a subscription."""
    owner = Owner('subscription', spec.name)
    call = node.call(
        owner,
        spec.path,
        return_result if spec.behaviour is None else node.bind(spec.behaviour),
        options=spec,
        deliver=node.publish_to(spec.publish),
        may_begin=node.gate.allows_events,
    )
    profile = create_qos_profile(spec.qos, node.system.profiles)
    endpoint = TopicEndpoint(node.ros, 'subscription', spec, profile, node.place(spec.path))
    node.endpoints.append(endpoint)
    subscription = node.ros.create_subscription(
        import_interface(spec.type),
        spec.topic,
        call.run,
        profile,
        callback_group=node.group(spec.group),
        event_callbacks=endpoint.subscription_events(),
    )
    node.count_missed(owner, subscription)
    return subscription
