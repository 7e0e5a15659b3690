"""Which publisher and subscription can never meet, by what one offers and the other requests.

The rules are those of DDS for request against offer, as rmw documents them
(https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Quality-of-Service-Settings.html) and
Fast DDS applies them. `rclpy.qos.qos_check_compatible` says the same but for two things: an
unlimited duration that is written out asks for no more than one that is left out, and a
publisher whose liveliness is left to the middleware has an automatic one, as DDS has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_NANOSECONDS = 1_000_000_000
_UNLIMITED = float('inf')

# For each policy the pairs of offered and requested that never match.
_HOPELESS = {
    'reliability': {('best_effort', 'reliable')},
    'durability': {('volatile', 'transient_local')},
    'liveliness': {('automatic', 'manual_by_topic'), ('system_default', 'manual_by_topic')},
}
_DURATIONS = ('deadline', 'liveliness_lease_duration')


@dataclass(frozen=True, slots=True)
class QosConflict:
    """A policy for which a publisher offers less than a subscription requests."""

    policy: str
    offered: str
    requested: str

    def __str__(self) -> str:
        """Return what is offered and what is requested."""
        return f'{self.policy}: {self.offered} is offered, {self.requested} is requested'


def find_qos_conflicts(
    offered: Mapping[str, Any], requested: Mapping[str, Any]
) -> Iterator[QosConflict]:
    """Yield every policy that keeps two ends apart for ever.

    A policy that is left to the middleware (`system_default`), or chosen by it when the other end
    is known (`best_available`), keeps nobody apart for ever.

    Args:
        offered: The policies of the publisher, as `resolve_qos` returns them.
        requested: Those of the subscription.
    """
    for policy, pairs in _HOPELESS.items():
        if (offered[policy], requested[policy]) in pairs:
            yield QosConflict(policy, offered[policy], requested[policy])
    for policy in _DURATIONS:
        given, wanted = offered.get(policy), requested.get(policy)
        if 'best_available' not in (given, wanted) and _duration(given) > _duration(wanted):
            yield QosConflict(policy, _shown(given), _shown(wanted))


def _duration(value: float | str | None) -> float:
    """Return a duration in nanoseconds, as the middleware gets it; 0 is none to it."""
    if value is None or isinstance(value, str):
        return _UNLIMITED
    return round(value * _NANOSECONDS) or _UNLIMITED


def _shown(value: float | str | None) -> str:
    duration = _duration(value)
    return 'infinite' if duration == _UNLIMITED else f'{value:g} s'
