"""Publishers: `node.publish`, and what behaviours return."""

from __future__ import annotations

from sys import getrefcount
from typing import TYPE_CHECKING

from composer.interfaces.classes import import_interface
from composer.runtime.entities.event_behaviours import EventBehaviours, events_of
from composer.runtime.health.unmatched import TopicEndpoint
from composer.runtime.messages.ownership import UNHELD_ARGUMENT
from composer.runtime.messages.payloads import converter_for

if TYPE_CHECKING:
    from composer.language.specs import PublisherSpec
    from composer.runtime.nodes.behaviour_node import Payload, Publish
    from composer.runtime.nodes.live_node import LiveNode


class Publisher:
    """A publisher.

    Attributes:
        publish: Publishes a payload on it.
        ros: The rclpy publisher.
        events: Its behaviours for QoS events.
    """

    __slots__ = (
        '_endpoint',
        '_has_dropped',
        '_local',
        '_node',
        '_publish',
        '_spec',
        'events',
        'publish',
        'ros',
    )

    def __init__(self, node: LiveNode, spec: PublisherSpec) -> None:
        message_class = import_interface(spec.type)
        profile = node.overrides.profile(spec, node.system.profiles, publishes=True)
        self._node = node
        self._spec = spec
        self._endpoint = TopicEndpoint(node.ros, 'publisher', spec, profile, node.placing(spec))
        self.events = EventBehaviours(node, 'publisher', spec.name)
        self.ros = node.ros.create_publisher(
            message_class,
            spec.topic,
            profile,
            callback_group=node.events,
            event_callbacks=self._endpoint.publisher_events(
                self.events.callbacks(events_of(spec))
            ),
        )
        node.endpoints.append(self._endpoint)
        self._local = node.system.topics.add_publisher(
            node.ros, self.ros, is_local=spec.local_delivery
        )
        send, convert = self._local.publish, converter_for(message_class).convert
        check, is_heard = converter_for(message_class, builds=False).convert, self._local.is_heard

        def publish(payload: Payload, unheld: int = UNHELD_ARGUMENT) -> None:
            if type(payload) is not message_class and not is_heard():
                check(payload)
                return
            message = convert(payload)
            is_held = message is payload and getrefcount(payload) > unheld
            send(message, is_held=is_held)

        self._publish: Publish = publish
        self._has_dropped = False
        self.publish: Publish = self._publish
        self.rest(rests=not node.gate.may_publish)

    def rest(self, *, rests: bool) -> None:
        """Drop what is published, as the node is not active; or publish again."""
        self._has_dropped = False
        self.publish = self._drop if rests else self._publish

    def _drop(self, payload: Payload, unheld: int = UNHELD_ARGUMENT) -> None:  # noqa: ARG002 - as `Publish`
        node, lifecycle = self._node, self._node.lifecycle
        if not self._has_dropped and lifecycle is not None:
            self._has_dropped = True
            text = f"publisher '{self._spec.name}' drops what is published"
            node.ros.get_logger().warning(f'{text}: the node is {lifecycle.state}')

    def delivery(self) -> tuple[str, str, int]:
        """Return which way messages go now, why, and how many; see `LocalPublisher.delivery`."""
        return *self._local.delivery(), self._local.published

    def change(self, spec: PublisherSpec) -> None:
        """See `LiveEntity`."""
        topics = self._node.system.topics
        topics.change_publisher(self._local, is_local=spec.local_delivery)
        self._spec = spec
        self.bind_events()

    def bind_events(self) -> None:
        """Call its behaviours for QoS events from now on; until then, these wait."""
        self.events.change(events_of(self._spec))

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self.events.destroy()
        self._node.endpoints.remove(self._endpoint)
        self._node.overrides.drop(self._spec, publishes=True)
        self._node.system.topics.remove_publisher(self._local)
        self._node.ros.destroy_publisher(self.ros)
