"""A split that is worth it, with the gain to expect, or why there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.records import record
from composer.suggestions.model import cost_of, gain_of
from composer.suggestions.search import find_split

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.suggestions.loads import SystemLoad
    from composer.suggestions.model import Cost, Split

# Less may be noise, and a process more is a process more.
LEAST_GAIN = 1.1
_ALMOST = 0.9
# Less is what runs on every computer.
_FEW_CORES = 0.1


@record
class Suggestion:
    """What to do about a system.

    Attributes:
        moves: The worker of each node that should move, by full names; none if no split pays.
        gain: How many times as much the system does then.
        before: What the present split costs.
        after: What the proposed one costs; that of the present if there is none.
        reason: Why no split pays; empty if one does.
    """

    load: SystemLoad
    moves: Mapping[str, str]
    gain: float
    before: Cost
    after: Cost
    reason: str = ''


def suggest_split(load: SystemLoad) -> Suggestion:
    """Return what to do about a system; the same load leads to the same suggestion."""
    before = cost_of(load, load.present)
    split = _named_by_nodes(load, find_split(load))
    gain = gain_of(load, split)
    if gain < LEAST_GAIN:
        return Suggestion(load, {}, 1.0, before, before, _explain_none(load, before, split))
    moves = {name: split[name] for name, worker in load.present.items() if split[name] != worker}
    return Suggestion(load, moves, gain, before, cost_of(load, split))


def _named_by_nodes(load: SystemLoad, split: Split) -> dict[str, str]:
    """Return a split whose new workers have the names of their largest nodes."""
    old = {*load.taken, *load.present.values(), ''}
    names = {name: name for name in old}
    for node in sorted(load.nodes, key=lambda each: (-each.cpu, each.name)):
        worker = split[node.name]
        if worker not in names:
            names[worker] = _free_name(node.name.rpartition('/')[2], set(names.values()))
    return {name: names[worker] for name, worker in split.items()}


def _free_name(wanted: str, taken: set[str]) -> str:
    name, number = wanted, 1
    while name in taken:
        number += 1
        name = f'{wanted}_{number}'
    return name


def _explain_none(load: SystemLoad, before: Cost, split: Split) -> str:
    if load.demand <= 1.0:
        busiest = max(before.by_worker.values(), default=0.0)
        return (
            'nothing is late, and no process is busy all the time '
            f'(the busiest {busiest:.0%} of a core): there is nothing to gain'
        )
    if len(load.nodes) - len(load.fixed) < 1:
        return 'no node can be moved'
    largest = max(load.nodes, key=lambda each: (each.cpu, each.name))
    if before.cpu >= _ALMOST * load.free_cores:
        others = f', and {load.others:.1f} by other programs' if tells_others(load) else ''
        return f'all {_cores(load.cores)} are used already ({before.cpu:.1f}{others})'
    if largest.cpu >= _ALMOST:
        return f'{largest.name} alone needs a core ({largest.cpu:.0%}), wherever it runs'
    crossing = cost_of(load, split).crossing
    if crossing > 0 and split != load.present:
        return f'messages between processes would cost what is won ({crossing:.0%} of a core)'
    return 'what is busy would be as busy in processes of its own'


def tells_others(load: SystemLoad) -> bool:
    """Return whether other programs use so much that it should be said."""
    return load.others >= _FEW_CORES


def _cores(count: int) -> str:
    return f'{count} core{"" if count == 1 else "s"}'
