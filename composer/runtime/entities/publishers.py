"""Publishers: `node.publish`, and what behaviours return."""

from __future__ import annotations

from sys import getrefcount
from typing import TYPE_CHECKING

from composer.interfaces.classes import import_interface
from composer.runtime.health.unmatched import TopicEndpoint
from composer.runtime.messages.ownership import UNHELD_ARGUMENT
from composer.runtime.messages.payloads import converter_for
from composer.runtime.messages.qos_profiles import create_qos_profile

if TYPE_CHECKING:
    from composer.language.specs import PublisherSpec
    from composer.runtime.nodes.behaviour_node import Payload, Publish
    from composer.runtime.nodes.live_node import LiveNode


class Publisher:
    """A publisher.

    Attributes:
        publish: Publishes a payload on it.
    """

    __slots__ = ('_endpoint', '_local', '_node', '_ros', 'publish')

    def __init__(self, node: LiveNode, spec: PublisherSpec) -> None:
        message_class = import_interface(spec.type)
        profile = create_qos_profile(spec.qos, node.system.profiles)
        self._node = node
        self._endpoint = TopicEndpoint(node.ros, 'publisher', spec, profile, node.placing(spec))
        self._ros = node.ros.create_publisher(
            message_class,
            spec.topic,
            profile,
            callback_group=node.events,
            event_callbacks=self._endpoint.publisher_events(),
        )
        node.endpoints.append(self._endpoint)
        self._local = node.system.topics.add_publisher(
            node.ros, self._ros, is_local=spec.local_delivery
        )
        send, convert = self._local.publish, converter_for(message_class).convert

        def publish(payload: Payload, unheld: int = UNHELD_ARGUMENT) -> None:
            message = convert(payload)
            is_held = message is payload and getrefcount(payload) > unheld
            send(message, is_held=is_held)

        self.publish: Publish = publish

    def delivery(self) -> tuple[str, str]:
        """Return which way messages go now, and why; see `LocalPublisher.delivery`."""
        return self._local.delivery()

    def change(self, spec: PublisherSpec) -> None:
        """See `LiveEntity`."""
        topics = self._node.system.topics
        topics.change_publisher(self._local, is_local=spec.local_delivery)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self._node.endpoints.remove(self._endpoint)
        self._node.system.topics.remove_publisher(self._local)
        self._node.ros.destroy_publisher(self._ros)
