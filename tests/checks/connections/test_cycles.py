"""Cycles in graphs, against the plainest way to find them."""

from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from composer.checks.connections.cycles import find_cycles, find_knots, find_way

NODES = range(6)
GRAPHS = st.dictionaries(st.sampled_from(NODES), st.lists(st.sampled_from(NODES), max_size=4))


def reachable(edges, start):
    found, pending = set(), [start]
    while pending:
        for after in edges.get(pending.pop(), ()):
            if after not in found:
                found.add(after)
                pending.append(after)
    return found


@settings(max_examples=40)
@given(GRAPHS)
def test_knots_are_the_sets_of_nodes_that_reach_each_other(edges):
    reach = {node: reachable(edges, node) for node in NODES}
    knots = {
        frozenset(other for other in NODES if other in reach[node] and node in reach[other])
        for node in NODES
        if node in reach[node]
    }
    assert {frozenset(knot) for knot in find_knots(edges)} == knots


@settings(max_examples=40)
@given(GRAPHS)
def test_each_knot_has_a_cycle_of_edges(edges):
    cycles = list(find_cycles(edges))
    assert len(cycles) == len(find_knots(edges))
    for cycle in cycles:
        for node, after in zip(cycle, [*cycle[1:], cycle[0]], strict=True):
            assert after in edges[node]


@settings(max_examples=40)
@given(GRAPHS)
def test_a_way_is_found_if_there_is_one(edges):
    way = find_way(edges, 0, {1}, NODES)
    assert (way is not None) == (1 in reachable(edges, 0))
    if way:
        assert (way[0], way[-1]) == (0, 1)
        assert all(after in edges[node] for node, after in pairwise(way))


def test_a_long_chain_needs_no_recursion():
    edges = {node: [node + 1] for node in range(20_000)}
    assert find_knots(edges) == []
    edges[20_000] = [0]
    assert len(next(find_cycles(edges))) == 20_001
