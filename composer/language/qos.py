"""QoS profiles by name, and the policies of a declared QoS.

The built-in profiles are those of rmw (`rmw/qos_profiles.h`), with rclpy's names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import QosSpec

# Policies that are durations, in seconds; `INFINITE` is no limit.
DURATIONS = ('deadline', 'lifespan', 'liveliness_lease_duration')
INFINITE = 'infinite'
NANOSECONDS = 1_000_000_000

DEFAULT_PROFILE = 'default'
SERVICES_PROFILE = 'services_default'

_DEFAULT = {
    'history': 'keep_last',
    'depth': 10,
    'reliability': 'reliable',
    'durability': 'volatile',
    'liveliness': 'system_default',
}

# Durations that are not named are infinite.
BUILTIN_PROFILES: dict[str, dict[str, Any]] = {
    DEFAULT_PROFILE: _DEFAULT,
    'sensor_data': _DEFAULT | {'depth': 5, 'reliability': 'best_effort'},
    SERVICES_PROFILE: _DEFAULT,
    'parameters': _DEFAULT | {'depth': 1000},
    'parameter_events': _DEFAULT | {'depth': 1000},
    'action_status_default': _DEFAULT | {'depth': 1, 'durability': 'transient_local'},
    'system_default': {
        'history': 'system_default',
        'depth': 0,
        'reliability': 'system_default',
        'durability': 'system_default',
        'liveliness': 'system_default',
    },
    'best_available': {
        'history': 'keep_last',
        'depth': 10,
        'reliability': 'best_available',
        'durability': 'best_available',
        'liveliness': 'best_available',
        'deadline': 'best_available',
        'liveliness_lease_duration': 'best_available',
    },
}

# What the middleware chooses for `best_available` where it knows no other end, or asks none
# (`rmw_dds_common/qos.hpp`). Publishers are created before all subscriptions of a system.
BEST_OF_PUBLISHERS = {
    'reliability': 'reliable',
    'durability': 'transient_local',
    'liveliness': 'automatic',
    'deadline': INFINITE,
    'liveliness_lease_duration': INFINITE,
}
BEST_OF_SERVICES = BEST_OF_PUBLISHERS | {'durability': 'volatile'}

# Nobody writes longer ones; thousands of profiles in a chain would take quadratic time.
_LONGEST_CHAIN = 50
# The values of policies with which messages may be handed over; any other is the middleware's.
_KEPT_LOCALLY = {
    'durability': ('volatile',),
    'history': ('keep_last', 'keep_all'),
    'reliability': ('reliable', 'best_effort'),
    'liveliness': ('automatic', 'system_default'),
}


class QosError(ComposerError):
    """A profile does not exist, or is based on itself.

    Attributes:
        spec: The QoS that names the profile.
    """

    def __init__(self, message: str, spec: QosSpec) -> None:
        super().__init__(message)
        self.spec = spec


def resolve_qos(spec: QosSpec, profiles: Mapping[str, QosSpec]) -> dict[str, Any]:
    """Return the policies of a QoS, including those of the profiles that it is based on.

    Args:
        profiles: The named profiles of the file.

    Raises:
        QosError: A profile does not exist, or is based on itself.
    """
    chain = [spec]
    while chain[-1].profile in profiles:
        following = profiles[chain[-1].profile]
        if following in chain:
            message = f"the QoS profile '{chain[-1].profile}' leads back to itself"
            raise QosError(message, chain[-1])
        if len(chain) > _LONGEST_CHAIN:
            message = f'more than {_LONGEST_CHAIN} QoS profiles start from each other'
            raise QosError(message, chain[-1])
        chain.append(following)
    base = BUILTIN_PROFILES.get(chain[-1].profile)
    if base is None:
        message = f"there is no QoS profile '{chain[-1].profile}'"
        raise QosError(message, chain[-1])
    policies = dict(base)
    for link in reversed(chain):
        policies |= link.policies
    return policies


def settle_best_available(policies: Mapping[str, Any], best: Mapping[str, Any]) -> dict[str, Any]:
    """Return policies with each that is `best_available` as `best` has it."""
    return {
        policy: best[policy] if value == 'best_available' else value
        for policy, value in policies.items()
    }


def format_policy_value(policy: str, value: Any) -> str:
    """Return `0.5 s` for a duration, and any other value as it is."""
    if policy in DURATIONS and not isinstance(value, str):
        return f'{value:g} s'
    return str(value)


def why_sent(policies: Mapping[str, Any]) -> str:
    """Return which policy only the middleware keeps; empty if messages may be handed over."""
    for name, values in _KEPT_LOCALLY.items():
        if policies[name] not in values:
            return f'{name}: {policies[name]}'
    # 0 is no limit, and neither is a word.
    limits = (name for name in ('deadline', 'lifespan') if policies.get(name))
    return next((name for name in limits if not isinstance(policies[name], str)), '')
