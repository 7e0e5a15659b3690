"""QoS policies ⇄ rclpy's `QoSProfile`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.duration import Duration, Infinite
from rclpy.publisher import Publisher
from rclpy.qos import (
    DeadlineBestAvailable,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessLeaseDurationeBestAvailable,
    LivelinessPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_system_default,
)
from rclpy.qos_overriding_options import QoSOverridingOptions, _declare_qos_parameters
from rclpy.service_introspection import ServiceIntrospectionState
from rclpy.subscription import Subscription

from composer.language.qos import DURATIONS, INFINITE, NANOSECONDS, resolve_qos
from composer.language.qos_conflicts import CONFLICTS, MATCHED_DURATIONS

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from rclpy.node import Node

    from composer.language.specs import Introspection, QosSpec

_POLICIES = {
    'history': HistoryPolicy,
    'reliability': ReliabilityPolicy,
    'durability': DurabilityPolicy,
    'liveliness': LivelinessPolicy,
}
_BEST_AVAILABLE = {
    'deadline': DeadlineBestAvailable,
    'liveliness_lease_duration': LivelinessLeaseDurationeBestAvailable,
}
# Longer durations are no limit: `Infinite`, and what is left to the middleware.
_LONGEST_NS = (2**31 - 1) * NANOSECONDS


def create_qos_profile(spec: QosSpec, profiles: Mapping[str, QosSpec]) -> QoSProfile:
    """Return the profile for a declared QoS.

    Args:
        profiles: The named profiles of the file.
    """
    policies = resolve_qos(spec, profiles)
    return QoSProfile(**{key: _convert(key, value) for key, value in policies.items()})


def read_policies(profile: QoSProfile) -> dict[str, Any]:
    """Return the policies of rclpy's profile that must match, as `resolve_qos` does."""
    policies: dict[str, Any] = {name: getattr(profile, name).name.lower() for name in CONFLICTS}
    for name in MATCHED_DURATIONS:
        duration_ns = getattr(profile, name).nanoseconds
        # 0 is no limit either.
        if 0 < duration_ns < _LONGEST_NS:
            policies[name] = duration_ns / NANOSECONDS
    return policies


def configure_introspection(ros: Node, end: Any, introspection: Introspection) -> None:
    """Let the middleware publish what it sees of each call of a service or client."""
    state = getattr(ServiceIntrospectionState, introspection.upper())
    end.configure_introspection(ros.get_clock(), qos_profile_system_default, state)


def apply_qos_overrides(
    ros: Node, topic: str, profile: QoSProfile, policies: Collection[str], *, publishes: bool
) -> None:
    """Let ROS parameters override policies of a profile, as rclpy does: they are declared.

    Args:
        topic: The full name of the topic.
    """
    kinds = [QoSPolicyKind[name.upper()] for name in policies]
    options = QoSOverridingOptions(kinds)
    entity = Publisher if publishes else Subscription
    _declare_qos_parameters(entity, ros, topic, profile, options)


def is_qos_profile(value: object) -> bool:
    """Return whether a value is a profile of rclpy."""
    return isinstance(value, QoSProfile)


def write_policies(profile: QoSProfile) -> dict[str, Any]:
    """Return a profile of rclpy as a file has it."""
    written: dict[str, Any] = {name: getattr(profile, name).name.lower() for name in _POLICIES}
    if profile.depth:
        written['depth'] = profile.depth
    for name in DURATIONS:
        duration_ns = getattr(profile, name).nanoseconds
        if 0 < duration_ns < _LONGEST_NS:
            written[name] = duration_ns / NANOSECONDS
    return written


def _convert(key: str, value: Any) -> Any:
    if key == 'depth':
        return value
    if key in _POLICIES:
        return _POLICIES[key][value.upper()]
    if value == INFINITE:
        return Infinite
    if value == 'best_available':
        return _BEST_AVAILABLE[key]
    return Duration(nanoseconds=round(value * NANOSECONDS))
