"""QoS policies → rclpy's `QoSProfile`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.duration import Duration, Infinite
from rclpy.qos import (
    DeadlineBestAvailable,
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessLeaseDurationeBestAvailable,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from composer.language.qos import INFINITE, NANOSECONDS, resolve_qos

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import QosSpec

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


def create_qos_profile(spec: QosSpec, profiles: Mapping[str, QosSpec]) -> QoSProfile:
    """Return the profile for a declared QoS.

    Args:
        profiles: The named profiles of the file.
    """
    policies = resolve_qos(spec, profiles)
    return QoSProfile(**{key: _convert(key, value) for key, value in policies.items()})


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
