"""QoS that ROS parameters override, as `qos_overrides.<topic>.publisher.depth` does."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from rcl_interfaces.msg import ParameterDescriptor

from composer.runtime.messages.qos_profiles import apply_qos_overrides, create_qos_profile

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rclpy.qos import QoSProfile

    from composer.language.specs import QosSpec, TopicEndSpec
    from composer.runtime.nodes.ros_node import ComposedRosNode


class QosOverrides:
    """The parameters that override the QoS of a node's publishers and subscriptions."""

    def __init__(self, ros: ComposedRosNode) -> None:
        self._ros = ros
        # How many ends have the same ones, by the beginning of their names.
        self._users: Counter[str] = Counter()

    def profile(
        self, spec: TopicEndSpec, profiles: Mapping[str, QosSpec], *, publishes: bool
    ) -> QoSProfile:
        """Return the QoS of a publisher or subscription, with what parameters override.

        Args:
            profiles: The named profiles of the file.
        """
        profile = create_qos_profile(spec.qos, profiles)
        if spec.qos_overrides:
            prefix = self._prefix(spec, publishes=publishes)
            # Files may give them other values since.
            self._undeclare(prefix)
            self._users[prefix] += 1
            topic = self._ros.resolve_topic_name(spec.topic)
            apply_qos_overrides(self._ros, topic, profile, spec.qos_overrides, publishes=publishes)
        return profile

    def drop(self, spec: TopicEndSpec, *, publishes: bool) -> None:
        """Undeclare the parameters of what is removed, unless another end has them."""
        if spec.qos_overrides:
            prefix = self._prefix(spec, publishes=publishes)
            self._users[prefix] -= 1
            if not self._users[prefix]:
                self._undeclare(prefix)

    def _prefix(self, spec: TopicEndSpec, *, publishes: bool) -> str:
        topic = self._ros.resolve_topic_name(spec.topic)
        return f'qos_overrides.{topic}.{"publisher" if publishes else "subscription"}.'

    def _undeclare(self, prefix: str) -> None:
        for name in self._ros.list_parameters([], 0).names:
            if name.startswith(prefix):
                # They are read-only.
                descriptor = ParameterDescriptor(name=name)
                self._ros.put_parameter(self._ros.get_parameter(name), descriptor)
                self._ros.undeclare_parameter(name)
