"""Cycles in directed graphs, in time that grows as the graph does, and loops of messages."""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

from composer.checks.behaviours.shipped_behaviours import is_shipped
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.return_values import always_answers
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping

    from composer.checks.connections.topology import Endpoint
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import BehaviourSpec

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


@record
class _Relay:
    """A subscription that publishes something for every message that it hears.

    Attributes:
        is_plain: Whether it passes them on as they are.
    """

    end: Endpoint
    heard: str
    published: str
    is_plain: bool


def check_loops(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that no message runs in a circle for ever.

    Relays without a behaviour pass on every message: an error. Behaviours of which every path
    returns a payload do so as well, and a closed loop of control may be meant: a warning. A
    behaviour that may return `None` can end the loop.
    """
    relays = list(_find_relays(context))
    plain = [relay for relay in relays if relay.is_plain]
    reported: set[str] = set()
    for loop in _find_loops(plain):
        reported |= {relay.heard for relay in loop}
        yield _explain(context, loop, 'relay-loop')
    for loop in _find_loops(relays):
        if not reported & {relay.heard for relay in loop}:
            yield _explain(context, loop, 'message-loop')


def _find_relays(context: CheckContext) -> Iterator[_Relay]:
    published = {
        (end.node.name, end.entity.name): channel.name
        for channel in context.topology.of_kind('topic')
        for end in channel.providers
    }
    for channel in context.topology.of_kind('topic'):
        for end in channel.users:
            relay = end.entity
            target = published.get((end.node.name, getattr(relay, 'publish', None) or ''))
            if target is None or context.was_dropped((*relay.path, 'behaviour')):
                continue
            behaviour = getattr(relay, 'behaviour', None)
            if behaviour is None or _passes_on(context, behaviour):
                yield _Relay(end, channel.name, target, is_plain=behaviour is None)


def _find_loops(relays: Iterable[_Relay]) -> Iterator[list[_Relay]]:
    by_edge: dict[tuple[str, str], _Relay] = {}
    for relay in relays:
        by_edge.setdefault((relay.heard, relay.published), relay)
    edges: dict[str, list[str]] = {}
    for heard, published in by_edge:
        edges.setdefault(heard, []).append(published)
    for cycle in find_cycles(edges):
        ring = [*cycle, cycle[0]]
        yield [by_edge[pair] for pair in pairwise(ring)]


def _explain(context: CheckContext, loop: list[_Relay], rule: str) -> Diagnostic:
    first, *others = loop
    names = [relay.heard for relay in loop]
    way = ' → '.join([*names, names[0]])
    return context.at_value(
        (*first.end.path, 'publish'),
        rule,
        f'messages go in a circle forever: {way}',
        help='publish on another topic, or let a behaviour return None where it ends',
        related=[
            context.related(relay.end.path, f"{relay.end} passes it on to '{relay.published}'")
            for relay in others
        ],
    )


# Of those that come with Composer; `drop` lets each message die out.
_PASSING = ('behaviours.topics:mux', 'behaviours.topics:throttle')


def _passes_on(context: CheckContext, behaviour: BehaviourSpec) -> bool:
    is_passing = behaviour.name in _PASSING and is_shipped(context, behaviour.module)
    return is_passing or _always_answers(context, behaviour)


def _always_answers(context: CheckContext, behaviour: BehaviourSpec) -> bool:
    """Return whether every path through a behaviour returns a payload."""
    source = context.modules.find_function(behaviour.module, behaviour.function)
    if source is None or source.definition is None:
        return False
    kinds = (FunctionKind.PLAIN, FunctionKind.COROUTINE)
    return source.kind in kinds and always_answers(source.definition)
