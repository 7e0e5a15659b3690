"""Subscriptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.calls import Owner
from composer.runtime.entities.qos_profiles import create_qos_profile
from composer.runtime.health.unmatched import TopicEndpoint

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import SubscriptionSpec
    from composer.runtime.nodes.live_node import LiveNode


def create_subscriptions(node: LiveNode) -> None:
    """Create the node's subscriptions, each with its behaviour, or passing messages on."""
    for spec in node.spec.subscriptions.values():
        owner = Owner('subscription', spec.name)
        call = node.call(
            owner,
            spec.path,
            _create_function(node, spec),
            rules=spec,
            publish=spec.publish,
            admits=node.gate.lets_events,
        )
        profile = create_qos_profile(spec.qos, node.services.profiles)
        endpoint = TopicEndpoint(node.ros, spec, profile, node.place(spec.path))
        node.endpoints.append(endpoint)
        subscription = node.ros.create_subscription(
            import_interface(spec.type),
            spec.topic,
            call.as_callback(),
            profile,
            callback_group=node.group(spec.group),
            event_callbacks=endpoint.subscription_events(),
        )
        node.follow(owner, subscription)


def _create_function(node: LiveNode, spec: SubscriptionSpec) -> Callable[[Any], Any]:
    if spec.behaviour is None:
        return _pass_on
    return node.bind(spec.behaviour)


def _pass_on(message: Any) -> Any:
    return message
