"""Publishers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.interfaces.classes import import_interface
from composer.runtime.entities.qos_profiles import create_qos_profile
from composer.runtime.health.unmatched import TopicEndpoint
from composer.runtime.messages.payloads import converter_for

if TYPE_CHECKING:
    from composer.language.specs import PublisherSpec
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.node import Payload, Publish


def create_publishers(node: LiveNode) -> None:
    """Create the node's publishers; behaviours reach them through `node.publishers`."""
    for spec in node.spec.publishers.values():
        node.publishers[spec.name] = _create_publisher(node, spec)


def _create_publisher(node: LiveNode, spec: PublisherSpec) -> Publish:
    message_class = import_interface(spec.type)
    profile = create_qos_profile(spec.qos, node.services.profiles)
    events = TopicEndpoint(node, spec, profile).publisher_events()
    send = node.ros.create_publisher(
        message_class, spec.topic, profile, event_callbacks=events
    ).publish
    convert = converter_for(message_class).convert

    def publish(payload: Payload) -> None:
        send(convert(payload))

    return publish
