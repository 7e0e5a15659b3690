"""Nodes and processes that move between hosts: they leave the one before they come to the other.

A part that starts again comes after all that leave, since it is held meanwhile.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.hosts.host_plan import HostPlan


def settle_exchanges(plans: Sequence[HostPlan]) -> list[HostPlan]:
    """Return the plans, in which parts start again that would gain and lose by one reload."""
    leaving, coming = _all(plans)

    def settle(plan: HostPlan) -> HostPlan:
        is_both = plan.coming & leaving and plan.leaving & coming
        if plan.action == 'reload' and is_both:
            return replace(plan, action='restart', reason='hosts exchange nodes')
        return plan

    return list(map(settle, plans))


def order_changes(plans: Sequence[HostPlan]) -> list[list[HostPlan]]:
    """Return the plans that change at the same time, in their order."""
    leaving, _ = _all(plans)
    last = [each for each in plans if each.action == 'reload' and each.coming & leaving]
    return [[each for each in plans if each not in last], last]


def _all(plans: Sequence[HostPlan]) -> tuple[frozenset[str], frozenset[str]]:
    """Return all that leave a host, and all that come to one."""
    none: frozenset[str] = frozenset()
    return none.union(*(each.leaving for each in plans)), none.union(
        *(each.coming for each in plans)
    )
