"""Expectations on the log, errors, the end, parameters, states and steps."""

import pytest

from composer.scenarios.expectations.evaluation import evaluate
from composer.scenarios.expectations.happenings import sort_events
from composer.scenarios.expectations.topic_expectations import compare_messages
from composer.scenarios.outcomes import Outcome
from tests.scenarios.expectations.conftest import at, case_of, step_of
from tests.scenarios.expectations.plain_messages import number, scan

TRACEBACK = 'Traceback (most recent call last):\n  File "a.py", line 1\nValueError: too far\n'
LOG = [
    at(1, 'log', 'info', 'ready'),
    at(2, 'log', 'warn', 'battery at 3 %'),
    at(3, 'log', 'error', 'stopped', node='/m'),
    at(4, 'error', "timer 'tick'", TRACEBACK),
]


@pytest.mark.parametrize(
    ('then', 'said_of_it'),
    [
        ({'log': 'n', 'level': 'info', 'count': 2}, []),
        ({'log': '*', 'level': 'error', 'text': 'stop'}, []),
        ({'log': '/n', 'matches': r'^battery at \d+ %$', 'within': [2, 2]}, []),
        (
            {'log': '/m', 'level': 'error', 'never': True},
            [('expected no error line of /m, got 1 error line at 3 s', '+ stopped')],
        ),
        (
            {'log': 'n', 'text': 'gone', 'within': [0, 5]},
            [('expected a line of /n with "gone" from 0 s to 5 s, got none among 2 lines',
              '+ /n: info: ready at 1 s\n+ /n: warn: battery at 3 % at 2 s')],
        ),
        (
            {'log': '/n', 'level': 'error'},
            [('expected an error line of /n, got none among 2 lines',
              '+ /n: info: ready at 1 s\n+ /n: warn: battery at 3 % at 2 s')],
        ),
        ({'error': '*', 'text': 'too far', 'count': 2},
         [('expected 2 errors of any node with "too far", got 1 error', '')]),
    ],
)  # fmt: skip
def test_lines_of_the_log_are_counted(said, then, said_of_it):
    unexpected = ("timer 'tick' of /n raised ValueError: too far at 4 s", TRACEBACK.rstrip())
    assert said(then, LOG) == ([] if 'error' in then else [unexpected]) + said_of_it


@pytest.mark.parametrize(
    ('then', 'is_expected'),
    [
        ({'error': 'n'}, True),
        ({'error': '/n', 'matches': 'ValueError: too (far|near)', 'within': [4, 4]}, True),
        ({'error': '/n', 'text': 'too near', 'count': 0}, False),
        ({'error': '/m', 'count': 0}, False),
        ({'error': '/n', 'within': [0, 3], 'count': 0}, False),
    ],
)
def test_an_error_that_no_expectation_names_fails_the_case(then, is_expected):
    failures = evaluate(case_of(then), LOG)
    assert [each.path for each in failures] == ([] if is_expected else [('cases', 'c')])


@pytest.mark.parametrize(
    ('then', 'code', 'message'),
    [
        ({'exit_code': 3}, 3, None),
        ({'exit_code': 3, 'within': [5, 5]}, 3, None),
        ({'exit_code': 0}, 3, 'expected the system to end with exit code 0, got 3 at 5 s'),
        ({'exit_code': 3, 'within': [0, 4]}, 3,
         'expected the system to end with exit code 3 from 0 s to 4 s, but it ended at 5 s'),
        ({'exit_code': 0}, None, 'expected the system to end with exit code 0, but it ran on'),
        ({'topic': '/a', 'never': True}, 3, 'the system ended with exit code 3 at 5 s'),
        ({'topic': '/a', 'never': True}, 0, None),
    ],
)  # fmt: skip
def test_the_end_of_the_system_is_expected(said, then, code, message):
    events = [] if code is None else [at(5, 'exit', '', code, node='')]
    assert [each for each, _ in said(then, events)] == ([message] if message else [])


PARAMETERS = {'/n': {'limit': 1.0, 'names': ['a']}}
SETTINGS = [at(2, 'parameter', 'limit', 2.0), at(2, 'parameter', 'limit', 2.5),
            at(4, 'parameter', 'limit', 3.0), at(9, 'parameter', 'late', 1)]  # fmt: skip


@pytest.mark.parametrize(
    ('then', 'got'),
    [
        ({'parameters': {'n': {'limit': 3, 'names': ['a'], 'late': 1}}}, None),
        ({'parameters': {'n': {'limit': 2.5}}, 'at': 2}, None),
        ({'parameters': {'n': {'limit': 2.4}}, 'at': 2, 'tolerance': 0.1}, None),
        ({'parameters': {'n': {'limit': 1}}, 'within': [1, 3]}, None),
        ({'parameters': {'n': {'limit': 2}}, 'at': 2},
         "expected 2 as parameter 'limit' of /n at 2 s, got 2.5"),
        ({'parameters': {'n': {'late': 1}}, 'at': 8}, "parameter 'late' of /n has no value at 8 s"),
        ({'parameters': {'n': {'names': ['b']}}},
         'expected ["b"] as parameter \'names\' of /n at 10 s, got ["a"]'),
    ],
)  # fmt: skip
def test_parameters_have_values(said, then, got):
    found = said(then, SETTINGS, parameters=PARAMETERS)
    assert [message for message, _ in found] == ([got] if got else [])


@pytest.mark.parametrize(
    ('then', 'got'),
    [
        ({'state': {'n': 'active'}}, None),
        ({'state': {'n': 'unconfigured'}, 'at': 0.5}, None),
        ({'state': {'n': 'inactive'}, 'within': [0, 2]}, None),
        ({'state': {'n': 'active'}, 'at': 1.5},
         'expected "active" as state of /n at 1.5 s, got "inactive"'),
    ],
)  # fmt: skip
def test_lifecycles_have_states(said, then, got):
    events = [at(1, 'state', 'state', 'inactive'), at(2, 'state', 'state', 'active')]
    assert [message for message, _ in said(then, events)] == ([got] if got else [])


CALL = {'at': 1, 'call': '/reset', 'response': {'data': 1}}
GOAL = {'send_goal': '/dock', 'feedback': [1, 2], 'result': {'data': 3}}


@pytest.mark.parametrize(
    ('step', 'outcome', 'key', 'message'),
    [
        (CALL, {'answer': number(1.0)}, None, None),
        (CALL, {'answer': number(2.0), 'end_ns': 2 * 10**9}, 'response',
         'the response of /reset at 2 s is not as expected'),
        (CALL, {}, 'call', 'the call of /reset has no response at 1 s: the case ended before'),
        ({'call': '/reset', 'fails': True}, {'problem': 'no server'}, None, None),
        (GOAL, {'status': 'succeeded', 'feedback': (number(1), number(1), number(2)), 'answer': number(3)},
         None, None),
        (GOAL, {'status': 'succeeded', 'feedback': (number(2), number(1)), 'answer': number(3)},
         'feedback', 'expected feedback 2 of the goal of /dock at 1 s, got none such among no message after those before'),
        ({'send_goal': '/dock'}, {'status': 'aborted', 'answer': number(3)}, 'send_goal',
         'expected the goal of /dock at 1 s to end as succeeded, got aborted'),
        ({'send_goal': '/dock', 'cancel_at': 1}, {'status': 'canceled', 'answer': number(3)}, None, None),
        ({'send_goal': '/dock', 'status': 'rejected'}, {'status': 'rejected'}, None, None),
        ({'set_parameters': {'n': {'a': 1}}}, {'problem': 'too small'}, 'set_parameters',
         'the parameters of /n cannot be set at 1 s: too small'),
        ({'set_parameters': {'n': {'a': 1}}, 'refused': True}, {'problem': 'too small'}, None, None),
        ({'set_parameters': {'n': {'a': 1}}, 'refused': True},
         {'answer': ["'b' of /m"], 'problem': 'too small'}, 'refused',
         "expected /n to refuse the parameters at 1 s, but 'b' of /m can be set"),
        ({'publish': '/a'}, {'problem': 'no type'}, 'publish', 'cannot publish on /a at 1 s: no type'),
    ],
)  # fmt: skip
def test_steps_have_outcomes(step, outcome, key, message):
    failures = evaluate(case_of(), [], [Outcome(step_of(step), 10**9, **outcome)])
    assert [each.message for each in failures] == ([message] if message else [])
    assert [each.path[4] for each in failures] == ([key] if key else [])


def like(found, recorded, **options):
    case = case_of({'topic': '/a', 'like': 'run.mcap', **options})
    events = [at(index, 'message', '/a', each) for index, each in enumerate(found)]
    happened = sort_events(events, [], 10**10, None)
    return [
        (each.message, each.diff)
        for each in compare_messages(case.expectations[0], recorded, happened)
    ]


def test_a_topic_is_like_its_recording():
    recorded = [scan(1.0), scan(2.0), scan(3.0)]
    assert like([scan(1.0), scan(2.0), scan(3.0)], recorded) == []
    assert like([scan(1.001), scan(2.0), scan(3.0)], recorded, tolerance=0.01) == []
    assert like([scan(1.0), scan(7.0), scan(3.0)], recorded, ignore=['origin.x']) == []
    assert like([scan(1.0), scan(7.0), scan(3.0)], recorded) == [
        ('message 2 on /a at 1 s is not as recorded', '  origin:\n-   x: 2.0\n+   x: 7.0')
    ]
    assert like([scan(1.0), scan(2.0)], recorded) == [
        ('/a has 2 messages, and 3 messages in the recording',
         '- {origin: {x: 3.0, y: 0.0}, ranges: [], frame: "laser"}')
    ]  # fmt: skip
