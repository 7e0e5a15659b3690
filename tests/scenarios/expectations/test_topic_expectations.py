"""Expectations on topics: how many messages, how often, in which order."""

from fractions import Fraction
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.scenarios.expectations.evaluation import evaluate
from composer.simulation.events import Event
from tests.scenarios.expectations.conftest import at, case_of
from tests.scenarios.expectations.plain_messages import Status, number, scan

RAMP = [at(time, 'message', '/ramp', number(float(time))) for time in range(6)]
STATUS = at(6, 'message', '/status', Status(level=b'\x02', flags=[b'\x01', b'\x00']))
SCANS = [
    at(1, 'message', '/scan', scan(1.0, [0.5])),
    at(2, 'message', '/scan', scan(2.0, [])),
]


@pytest.mark.parametrize(
    'then',
    [
        {'topic': 'ramp'},
        {'topic': '/ramp', 'where': 'data == 3', 'within': [3, 3]},
        {'topic': '/ramp', 'count': [6, 9]},
        {'topic': '/ramp', 'never': 'data > 5'},
        {'topic': '/ramp', 'where': 'data > 4', 'never': 'data < 5'},
        {'topic': '/ramp', 'eventually': 'data == 5'},
        {'topic': '/ramp', 'message': {'data': 2.01}, 'tolerance': 0.01},
        {'topic': '/ramp', 'message': 2, 'within': [2, 2]},
        {'topic': '/scan', 'message': {'origin': {'x': 2}}, 'count': 1},
        {'topic': '/ramp', 'rate': [1, 1], 'between': [0, 6]},
        {'order': [{'topic': '/ramp', 'where': 'data == 1'}, {'topic': '/scan'}, {'topic': '/ramp'}]},
        {'topic': '/status', 'where': 'level == 2 and flags[0] == 1 and flags | sum < level'},
        {'topic': '/status', 'message': {'level': 2, 'flags': [1, 0]}},
    ],
)  # fmt: skip
def test_what_holds_says_nothing(said, then):
    events = sorted([*RAMP, *SCANS, STATUS], key=lambda each: each.time_ns)
    assert said(then, events) == []


@pytest.mark.parametrize(
    ('then', 'message', 'diff'),
    [
        (
            {'topic': '/ramp', 'where': 'data == 5', 'within': [2, 3.5]},
            'expected a message on /ramp where data == 5 from 2 s to 3.5 s, got none among '
            '2 messages; there is one at 5 s',
            ['+ {data: 3.0}'],
        ),
        (
            {'topic': '/other'},
            'expected a message on /other, got none',
            [],
        ),
        (
            {'topic': '/ramp', 'never': 'data > 3'},
            'expected no message on /ramp where data > 3, got 2 messages, the first at 4 s',
            ['+ {data: 4.0}'],
        ),
        (
            {'topic': '/ramp', 'count': [1, 2]},
            'expected 1 to 2 messages on /ramp, got 6 messages, the first too many at 2 s',
            ['+ {data: 2.0}'],
        ),
        (
            {'topic': '/scan', 'message': {'frame': 'laser', 'origin': {'x': 3, 'y': 0}}},
            'expected a message on /scan with {frame: "laser", origin: {x: 3, y: 0}}, got none '
            'among 2 messages; the nearest is that at 2 s',
            ['  origin:', '-   x: 3', '+   x: 2.0'],
        ),
        (
            {'topic': '/ramp', 'rate': [9.5, 10.5], 'between': [0, 5]},
            'expected 9.5 to 10.5 messages a second on /ramp from 0 s to 5 s, got 1 (5 messages)',
            [],
        ),
        (
            {'order': [{'topic': '/ramp', 'where': 'data == 4'}, {'topic': '/scan'}]},
            'expected message 2 of the order, a message on /scan after that of /ramp at 4 s, '
            'got none',
            [],
        ),
        (
            {'topic': '/scan', 'where': 'ranges[0] < 1'},
            "'ranges[0] < 1' cannot be evaluated for the message on /scan at 2 s: "
            'list object has no element 0',
            ['+ {origin: {x: 2.0, y: 0.0}, ranges: [], frame: "laser"}'],
        ),
    ],
)
def test_what_does_not_hold_is_told(said, then, message, diff):
    events = sorted([*RAMP, *SCANS], key=lambda each: each.time_ns)
    assert said(then, events) == [(message, '\n'.join(diff))]


def test_a_failure_leads_to_its_place_and_moment():
    (failure,) = evaluate(case_of({'topic': '/a', 'never': True}, {'topic': '/ramp', 'never': 'data > 3'}), RAMP)  # fmt: skip
    assert failure.path == ('cases', 'c', 'then', 1)
    assert failure.time_ns == 4 * 10**9
    assert failure.names == ('/ramp',)


# Few times, so that many fall on the ends of windows.
TIMES = st.integers(0, 6)
MESSAGES = st.lists(st.tuples(TIMES, st.sampled_from('ab'), st.integers(0, 3)), max_size=9).map(
    lambda found: sorted(found, key=lambda each: each[0])
)


def events_of(found):
    return [Event(time * 10**9, 'message', '/n', f'/{topic}', number(float(value)))
            for time, topic, value in found]  # fmt: skip


@given(MESSAGES, TIMES, TIMES, st.integers(0, 3), st.integers(0, 3), st.integers(0, 3))
def test_messages_are_counted_in_the_window(found, start, end, limit, least, more):
    counted = sum(
        1
        for time, topic, value in found
        if topic == 'a' and start <= time <= end and value > limit
    )
    then = {
        'topic': '/a',
        'where': f'data > {limit}',
        'within': [start, end],
        'count': [least, least + more],
    }
    failures = evaluate(case_of(then), events_of(found))
    assert (failures == []) == (least <= counted <= least + more)


@given(MESSAGES, TIMES, st.integers(1, 6), st.integers(0, 20), st.integers(0, 20))
def test_a_rate_is_a_number_of_messages_by_a_time(found, start, length, low, span):
    counted = sum(1 for time, topic, _ in found if topic == 'a' and start <= time < start + length)
    bounds = [low / 10, (low + span) / 10]
    then = {'topic': '/a', 'rate': bounds, 'between': [start, start + length]}
    is_right = Fraction(low, 10) <= Fraction(counted, length) <= Fraction(low + span, 10)
    assert (evaluate(case_of(then), events_of(found)) == []) == is_right


@given(MESSAGES, st.lists(st.tuples(st.sampled_from('ab'), st.integers(0, 3)), min_size=2, max_size=4))  # fmt: skip
def test_an_order_is_there_if_any_choice_of_messages_has_it(found, wanted):
    then = {'order': [{'topic': topic, 'where': f'data >= {value}'} for topic, value in wanted]}
    is_there = any(
        all(
            topic == chosen and value >= least
            for (_, chosen, value), (topic, least) in zip(choice, wanted, strict=True)
        )
        for choice in combinations(found, len(wanted))
    )
    assert (evaluate(case_of(then), events_of(found)) == []) == is_there


def test_the_ends_of_a_window_are_exact(said):
    event = at(0.3, 'message', '/a', number(1.0))
    assert said({'topic': '/a', 'within': [0.1, 0.3]}, [event]) == []
    assert said({'topic': '/a', 'within': [0.3, 0.4]}, [event]) == []
    assert said({'topic': '/a', 'within': [0.300000001, 0.4]}, [event]) != []
