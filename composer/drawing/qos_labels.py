"""The QoS of an edge as text: the policies that differ from the default of ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.language.qos import (
    BUILTIN_PROFILES,
    DEFAULT_PROFILE,
    INFINITE,
    QosError,
    format_policy_value,
    resolve_qos,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import QosSpec

# Policies whose values are clear without their names.
_SELF_EXPLANATORY = ('reliability', 'durability', 'history')


def differing_policies(spec: QosSpec | None, profiles: Mapping[str, QosSpec]) -> dict[str, Any]:
    """Return the policies that differ from the profile `default`; none if the QoS is invalid.

    Topics and services have the same defaults (`rmw/qos_profiles.h`).

    Args:
        profiles: The named profiles of the file.
    """
    try:
        policies = resolve_qos(spec, profiles) if spec else {}
    except QosError:
        return {}
    usual = BUILTIN_PROFILES[DEFAULT_PROFILE]
    return {key: value for key, value in policies.items() if value != usual.get(key, INFINITE)}


def describe_policies(policies: Mapping[str, Any]) -> str:
    """Return `best_effort, depth 5, deadline 0.1 s`."""
    return ', '.join(_describe(key, value) for key, value in policies.items())


def _describe(key: str, value: Any) -> str:
    if key in _SELF_EXPLANATORY and value not in ('system_default', 'best_available'):
        return str(value)
    return f'{key.replace("_", " ")} {format_policy_value(key, value)}'
