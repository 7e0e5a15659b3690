"""Cycles in directed graphs, in time that grows as the graph does."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Collection, Hashable, Iterator, Mapping

    Edges = Mapping['Node', Collection['Node']]

Node = TypeVar('Node', bound='Hashable')


def find_cycles(edges: Edges[Node]) -> Iterator[list[Node]]:
    """Yield one shortest cycle, from its first node on, for each component of a graph.

    A knot is a strongly connected component: however many cycles it has, to cut one is the first
    thing to do.
    """
    order = {node: index for index, node in enumerate(edges)}
    for knot in find_knots(edges):
        first = min(knot, key=lambda node: order[node])
        way = find_way(edges, first, {first}, knot)
        if way:
            yield way[:-1]


def find_knots(edges: Edges[Node]) -> list[set[Node]]:
    """Return the strongly connected components with a cycle (Tarjan, without recursion)."""
    index: dict[Node, int] = {}
    low: dict[Node, int] = {}
    stack: dict[Node, None] = {}
    knots: list[set[Node]] = []
    for root in edges:
        if root in index:
            continue
        index[root] = low[root] = len(index)
        stack[root] = None
        pending = [(root, iter(edges[root]))]
        while pending:
            node, following = pending[-1]
            for after in following:
                if after not in index:
                    index[after] = low[after] = len(index)
                    stack[after] = None
                    pending.append((after, iter(edges.get(after, ()))))
                    break
                if after in stack:
                    low[node] = min(low[node], index[after])
            else:
                pending.pop()
                if pending:
                    above = pending[-1][0]
                    low[above] = min(low[above], low[node])
                if low[node] == index[node]:
                    knot = _pop_until(stack, node)
                    if len(knot) > 1 or node in edges.get(node, ()):
                        knots.append(knot)
    return knots


def find_way(
    edges: Edges[Node], start: Node, goals: Collection[Node], within: Collection[object]
) -> list[Node] | None:
    """Return a shortest path of at least one edge from `start` to any goal, with both ends."""
    came_from: dict[Node, Node] = {}
    pending = deque([start])
    while pending:
        node = pending.popleft()
        for after in edges.get(node, ()):
            if after in goals:
                way = [after, node]
                while way[-1] != start:
                    way.append(came_from[way[-1]])
                return way[::-1]
            if after in within and after not in came_from and after != start:
                came_from[after] = node
                pending.append(after)
    return None


def _pop_until(stack: dict[Node, None], last: Node) -> set[Node]:
    popped = set()
    while True:
        node, _ = stack.popitem()
        popped.add(node)
        if node == last:
            return popped
