"""Finds a good split: the largest nodes first, each into the emptiest process, then single moves.

Longest processing time first (Graham 1969, https://doi.org/10.1137/0117039) leaves out what goes
between nodes, so moves and exchanges follow for as long as one is better (local search). All is
done in a fixed order: the same figures lead to the same split.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from composer.records import record
from composer.suggestions.model import cost_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from composer.suggestions.loads import NodeLoad, SystemLoad
    from composer.suggestions.model import Split

# A process more must pay: it has a participant and a copy of Python of its own.
_COST_OF_PROCESS = 0.01
_COST_OF_CROSSING = 0.1
_COST_OF_MOVE = 0.002
_LEAST_BETTER = 1e-9
_MOST_ROUNDS = 200
_MOST_GROUPS = 64


@record
class _Group:
    """Nodes that move together."""

    nodes: Sequence[NodeLoad]

    @property
    def cpu(self) -> float:
        return sum(node.cpu for node in self.nodes)

    def in_worker(self, name: str) -> dict[str, str]:
        """Return where its nodes are if it is in a worker."""
        return {node.name: name for node in self.nodes}


def find_split(load: SystemLoad) -> Split:
    """Return the best split that was found; that of the present if none is better."""
    groups = _group(load)
    movable = [each for each in groups if _is_movable(load, each)][:_MOST_GROUPS]
    best = dict(load.present)
    best_score = _score(load, best)
    for count in range(1, min(len(movable), load.cores + 1) + 1):
        split = _improve(load, movable, _assign(load, movable, count))
        score = _score(load, split)
        if score < best_score - _LEAST_BETTER:
            best, best_score = split, score
    return best


def _group(load: SystemLoad) -> list[_Group]:
    """Return all nodes in groups, those that need most first."""
    parent = {node.name: node.name for node in load.nodes}

    def root(name: str) -> str:
        while parent[name] != name:
            name = parent[name]
        return name

    for names in load.together:
        first, *others = sorted(names & parent.keys()) or ['']
        for other in others:
            parent[root(other)] = root(first)
    members: dict[str, list[NodeLoad]] = {}
    for node in load.nodes:
        members.setdefault(root(node.name), []).append(node)
    groups = [_Group(sorted(each, key=lambda node: node.name)) for each in members.values()]
    return sorted(groups, key=lambda each: (-each.cpu, each.nodes[0].name))


def _is_movable(load: SystemLoad, group: _Group) -> bool:
    # Of a node that did nothing, it is not known what it needs.
    is_fixed = any(node.name in load.fixed for node in group.nodes)
    return not is_fixed and any(node.cpu for node in group.nodes)


def _assign(load: SystemLoad, movable: Sequence[_Group], count: int) -> dict[str, str]:
    """Return a split with so many processes beside that of the system, the largest first."""
    split = dict(load.present)
    moving = {node.name for group in movable for node in group.nodes}
    busy = dict.fromkeys(['', *_name_workers(load, count)], 0.0)
    for node in load.nodes:
        if node.name not in moving:
            busy[node.worker] = busy.get(node.worker, 0.0) + node.cpu
    for group in movable:
        # Of equals, the first.
        name = min(busy, key=lambda each: busy[each])
        busy[name] += group.cpu
        split.update({node.name: name for node in group.nodes})
    return split


def _name_workers(load: SystemLoad, count: int) -> list[str]:
    """Return workers: those that there are, with new ones as far as they are needed."""
    present = sorted({node.worker for node in load.nodes} - {''})
    taken = {*present, *load.taken}
    new = (name for number in itertools.count(1) if (name := f'worker_{number}') not in taken)
    return [*present, *itertools.islice(new, max(0, count - len(present)))]


def _improve(load: SystemLoad, movable: Sequence[_Group], split: dict[str, str]) -> dict[str, str]:
    score = _score(load, split)
    for _ in range(_MOST_ROUNDS):
        found = min(
            ((_score(load, each), number, each) for number, each in _neighbours(movable, split)),
            key=lambda each: each[:2],
            default=None,
        )
        if found is None or found[0] >= score - _LEAST_BETTER:
            break
        score, _, split = found
    return split


def _neighbours(
    movable: Sequence[_Group], split: Mapping[str, str]
) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield each split in which one group has moved, or two have changed places."""
    number = 0
    for index, group in enumerate(movable):
        own = split[group.nodes[0].name]
        moved = [
            {**split, **group.in_worker(name)} for name in sorted({'', *split.values()} - {own})
        ]
        exchanged = [
            {**split, **group.in_worker(theirs), **other.in_worker(own)}
            for other in movable[index + 1 :]
            if (theirs := split[other.nodes[0].name]) != own
        ]
        for each in (*moved, *exchanged):
            number += 1
            yield number, each


def _score(load: SystemLoad, split: Split) -> float:
    cost = cost_of(load, split)
    moved = sum(split[node.name] != node.worker for node in load.nodes)
    return (
        cost.busiest
        + _COST_OF_CROSSING * cost.crossing
        + _COST_OF_PROCESS * len({*split.values(), ''})
        + _COST_OF_MOVE * moved
    )
