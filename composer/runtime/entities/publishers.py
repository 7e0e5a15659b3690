"""Publishers: `node.publish`, and what behaviours return."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.interfaces.classes import import_interface
from composer.runtime.health.unmatched import TopicEndpoint
from composer.runtime.messages.payloads import converter_for
from composer.runtime.messages.qos_profiles import create_qos_profile

if TYPE_CHECKING:
    from composer.language.specs import PublisherSpec
    from composer.runtime.nodes.behaviour_node import Payload, Publish
    from composer.runtime.nodes.live_node import LiveNode


def create_publisher(node: LiveNode, spec: PublisherSpec) -> Publish:
    """Create a publisher; return what publishes a payload on it."""
    message_class = import_interface(spec.type)
    profile = create_qos_profile(spec.qos, node.system.profiles)
    endpoint = TopicEndpoint(node.ros, 'publisher', spec, profile, node.place(spec.path))
    node.endpoints.append(endpoint)
    send = node.ros.create_publisher(
        message_class, spec.topic, profile, event_callbacks=endpoint.publisher_events()
    ).publish
    convert = converter_for(message_class).convert

    def publish(payload: Payload) -> None:
        send(convert(payload))

    return publish
