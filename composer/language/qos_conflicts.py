"""Conflicts between the QoS of a publisher and of a subscription.

The rules are those of DDS for requested against offered policies, as rmw documents them
(https://docs.ros.org/en/jazzy/Concepts/Intermediate/About-Quality-of-Service-Settings.html) and
Fast DDS applies them. `rclpy.qos.qos_check_compatible` agrees, with two exceptions: an infinite
duration that is written out requests no more than one that is left out, and a publisher whose
liveliness is left to the middleware has an automatic one, as in DDS.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from composer.language.qos import INFINITE, NANOSECONDS, format_policy_value
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

PolicyValue: TypeAlias = str | float

# The pairs of an offered and a requested value that never match, by policy.
CONFLICTS = {
    'reliability': {('best_effort', 'reliable')},
    'durability': {('volatile', 'transient_local')},
    'liveliness': {('automatic', 'manual_by_topic'), ('system_default', 'manual_by_topic')},
}
# The offered duration must not be longer than the requested one.
MATCHED_DURATIONS = ('deadline', 'liveliness_lease_duration')
# All that a match depends on.
MATCHED_POLICIES = frozenset((*CONFLICTS, *MATCHED_DURATIONS))


@record
class QosConflict:
    """A policy for which a publisher offers less than a subscription requests."""

    policy: str
    offered: PolicyValue
    requested: PolicyValue

    def __str__(self) -> str:
        """Return what is offered and what is requested."""
        return self.describe('', '')

    def describe(self, publisher: str, subscription: str) -> str:
        """Return what is offered and what is requested, with a text after each."""
        offered = format_policy_value(self.policy, self.offered)
        requested = format_policy_value(self.policy, self.requested)
        return (
            f'{self.policy}: {offered} is offered{publisher}, '
            f'{requested} is requested{subscription}'
        )


def describe_conflicts(conflicts: Sequence[QosConflict], *, from_publisher: bool) -> str:
    """Return conflicts, and what to do about them, as seen from one of both ends.

    Args:
        from_publisher: Whether that is the publisher.
    """
    places = (' here', ' there') if from_publisher else (' there', ' here')
    texts = '; '.join(each.describe(*places) for each in conflicts)
    offers, requests = (
        ', '.join(f'{each.policy}: {_format_yaml(value)}' for each, value in values)
        for values in (
            [(each, each.offered) for each in conflicts],
            [(each, each.requested) for each in conflicts],
        )
    )
    here, there = (requests, offers) if from_publisher else (offers, requests)
    return f"{texts}; set 'qos: {{{here}}}' here, or 'qos: {{{there}}}' there"


def _format_yaml(value: PolicyValue) -> str:
    return value if isinstance(value, str) else f'{value:g}'


def find_qos_conflicts(
    offered: Mapping[str, Any], requested: Mapping[str, Any]
) -> Iterator[QosConflict]:
    """Yield every policy that prevents a match for ever.

    A policy that is left to the middleware (`system_default`), or chosen by it when the other end
    is known (`best_available`), never does.

    Args:
        offered: The policies of the publisher, as `resolve_qos` returns them.
        requested: Those of the subscription.
    """
    for policy, pairs in CONFLICTS.items():
        if (offered[policy], requested[policy]) in pairs:
            yield QosConflict(policy, offered[policy], requested[policy])
    for policy in MATCHED_DURATIONS:
        pair = offered.get(policy, INFINITE), requested.get(policy, INFINITE)
        if 'best_available' not in pair and _nanoseconds(pair[0]) > _nanoseconds(pair[1]):
            yield QosConflict(policy, *map(_without_zero, pair))


def _nanoseconds(value: PolicyValue) -> float:
    """Return a duration for the middleware, where 0 means no limit."""
    if isinstance(value, str):
        return float('inf')
    return round(value * NANOSECONDS) or float('inf')


def _without_zero(value: PolicyValue) -> PolicyValue:
    return INFINITE if _nanoseconds(value) == float('inf') else value
