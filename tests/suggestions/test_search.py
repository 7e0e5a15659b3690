"""Splits that are proposed: never worse than none, within what is allowed, always the same."""

import random
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from composer.suggestions.loads import Flow, NodeLoad, SystemLoad
from composer.suggestions.model import cost_of, gain_of, send_sec, take_sec
from composer.suggestions.search import find_split
from composer.suggestions.suggestion import LEAST_GAIN, suggest_split
from composer.suggestions.text import render_text

MEGABYTE = 1e6


def load_of(shares, flows=(), **more):
    """Return the load of nodes `/a`, `/b`, ..."""
    nodes = [NodeLoad(f'/{name}', each) for name, each in zip('abcdefgh', shares, strict=False)]
    return SystemLoad(nodes=nodes, flows=flows, **{'cores': 2, **more})


@st.composite
def loads(draw):
    count = draw(st.integers(1, 7))
    names = [f'/{each}' for each in 'abcdefg'[:count]]
    share = st.floats(0, 1).map(lambda each: each / count)
    workers = st.sampled_from(['', '', 'old', 'older'])
    nodes = [NodeLoad(name, draw(share), draw(workers)) for name in names]
    flow = st.builds(
        Flow,
        st.sampled_from(['/x', '/y']),
        st.sampled_from(names),
        st.sampled_from(names),
        st.floats(0, 200),
        st.floats(0, 6 * MEGABYTE),
        st.booleans(),
    )
    groups = draw(st.lists(st.frozensets(st.sampled_from(names), min_size=1), max_size=2))
    together = []
    for group in groups:
        # Who must be together is so already.
        workers_of = {node.worker for node in nodes if node.name in group}
        if len(workers_of) == 1:
            together.append(group)
    return SystemLoad(
        nodes=nodes,
        flows=draw(st.lists(flow, max_size=6)),
        cores=draw(st.integers(1, 8)),
        demand=draw(st.sampled_from([1.0, 1.5, 4.0, float('inf')])),
        together=together,
        fixed=draw(st.frozensets(st.sampled_from(names), max_size=2)),
        taken=frozenset({'old', 'older', 'worker_1'}),
    )


@given(loads())
@settings(max_examples=60, deadline=None)
def test_a_split_is_never_worse_than_none_and_keeps_to_what_is_said(load):
    result = suggest_split(load)
    split = {**load.present, **result.moves}
    assert result.after == cost_of(load, split)
    assert result.gain >= LEAST_GAIN or not result.moves
    assert result.after.busiest <= result.before.busiest + 1e-9
    assert not result.moves.keys() & load.fixed
    for group in load.together:
        assert len({split[name] for name in group}) == 1
    assert bool(result.reason) == (not result.moves)
    assert suggest_split(load) == result
    # Moved somewhere else than it was, and never into a worker that has its name by chance.
    assert all(load.present[name] != worker for name, worker in result.moves.items())
    assert not set(result.moves.values()) & {'worker_1'}


@given(loads(), st.randoms())
@settings(max_examples=25, deadline=None)
def test_the_order_of_nodes_and_flows_does_not_matter(load, chance):
    nodes, flows = list(load.nodes), list(load.flows)
    chance.shuffle(nodes)
    chance.shuffle(flows)
    shuffled = SystemLoad(
        nodes, flows, load.cores, load.demand, load.together, load.fixed, load.taken
    )
    one, other = suggest_split(load), suggest_split(shuffled)
    assert other.after.busiest == pytest.approx(one.after.busiest, abs=1e-6)


def best_by_trying_all(load):
    """Return the least busy split of all that there are."""
    names = [node.name for node in load.nodes]
    processes = ['', 'p', 'q', 'r'][: load.cores + 2]
    splits = (
        dict(zip(names, each, strict=True)) for each in product(processes, repeat=len(names))
    )
    return min(cost_of(load, split).busiest for split in splits)


@pytest.mark.parametrize('seed', range(5))
def test_a_small_system_is_split_almost_as_well_as_can_be(seed):
    chance = random.Random(seed)
    shares = [chance.random() for _ in range(5)]
    load = load_of([each / sum(shares) for each in shares])
    assert cost_of(load, find_split(load)).busiest <= best_by_trying_all(load) + 0.05


def test_four_that_want_a_core_each_do_twice_as_much_on_two():
    result = suggest_split(load_of([0.24] * 4, demand=0.8 / 0.24))
    assert result.gain == pytest.approx(1.98, abs=0.05)
    assert result.after.busiest == pytest.approx(0.48)


def test_with_more_cores_there_are_more_processes():
    result = suggest_split(load_of([0.24] * 4, cores=8))
    assert len({**dict.fromkeys('abcd', ''), **result.moves}.values()) >= 4
    assert result.gain == pytest.approx(0.95 / 0.24, rel=0.05)


def test_no_split_pays_where_all_cores_are_used():
    result = suggest_split(load_of([0.9, 0.9]))
    assert result.moves == {}
    assert result.reason == 'all 2 cores are used already (1.8)'


def test_who_exchanges_big_messages_stays_together():
    heavy = [
        Flow('/x', '/a', '/b', 30.0, 2 * MEGABYTE),
        Flow('/y', '/c', '/d', 30.0, 2 * MEGABYTE),
    ]
    result = suggest_split(load_of([0.25, 0.23, 0.25, 0.23], heavy))
    split = {**dict.fromkeys(['/a', '/b', '/c', '/d'], ''), **result.moves}
    assert split['/a'] == split['/b'] != split['/c'] == split['/d']
    assert result.after.crossing == 0


def test_no_split_pays_where_messages_cost_more():
    flows = [Flow('/x', '/a', '/b', 100.0, 6 * MEGABYTE)]
    result = suggest_split(load_of([0.5, 0.45], flows))
    assert result.moves == {}
    assert 'busy' in result.reason or 'messages' in result.reason


@pytest.mark.parametrize(
    ('load', 'reason'),
    [
        (
            load_of([0.2, 0.1], demand=1.0),
            'nothing is late, and no process is busy all the time '
            '(the busiest 30% of a core): there is nothing to gain',
        ),
        (load_of([0.95, 0.01]), '/a alone needs a core (95%), wherever it runs'),
        (load_of([0.5, 0.45], cores=1), 'all 1 core are used already (0.9)'),
        (load_of([0.5, 0.45], fixed=frozenset({'/a', '/b'})), 'no node can be moved'),
    ],
)
def test_it_is_said_why_no_split_pays(load, reason):
    assert suggest_split(load).reason == reason


def test_new_workers_have_the_names_of_their_largest_nodes():
    nodes = [NodeLoad('/eyes/left', 0.5), NodeLoad('/eyes/right', 0.45)]
    result = suggest_split(SystemLoad(nodes, [], 2, taken=frozenset({'left', 'right'})))
    assert set(result.moves.values()) <= {'left_2', 'right_2'}
    assert result.moves


def test_what_crosses_is_sent_once_and_taken_by_each():
    flows = [Flow('/x', '/a', each, 10.0, MEGABYTE) for each in ('/b', '/c')]
    load = load_of([0.1, 0.1, 0.1], flows)
    split = {'/a': '', '/b': 'p', '/c': 'p'}
    cost = cost_of(load, split)
    assert cost.crossing == pytest.approx(10 * (send_sec(MEGABYTE) + 2 * take_sec(MEGABYTE)))
    assert cost.by_worker['p'] == pytest.approx(0.2 + 20 * take_sec(MEGABYTE))
    assert gain_of(load, load.present) == 1.0


@pytest.mark.parametrize(('worker', 'more'), [('', ''), ('old', ' more')])
def test_it_is_said_whether_messages_cross_already(worker, more):
    nodes = [NodeLoad('/a', 0.5), NodeLoad('/b', 0.45), NodeLoad('/c', 0, worker)]
    flows = [Flow('/x', '/a', '/b', 10.0, MEGABYTE)]
    text = render_text(suggest_split(SystemLoad(nodes, flows, cores=4)), 'it', '', '')
    assert f'  messages between them: 4% of a core{more}\n' in text


def test_what_crossed_already_is_won_when_it_does_no_more():
    nodes = [NodeLoad('/a', 0.3), NodeLoad('/b', 0.3, 'p')]
    load = SystemLoad(nodes, [Flow('/x', '/a', '/b', 10.0, MEGABYTE)], 2)
    assert cost_of(load, load.present).crossing == pytest.approx(0)
    assert cost_of(load, {'/a': '', '/b': ''}).crossing < 0
