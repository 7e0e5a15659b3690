"""Payloads of stand-ins: expressions over a request or a goal take the place of their texts."""

import re

import pytest

from composer.scenarios.running.stand_in_servers import PayloadError, compute_payload
from tests.scenarios.expectations.plain_messages import number, scan


@pytest.mark.parametrize(
    ('data', 'payload'),
    [
        ({'success': True}, {'success': True}),
        ('{{ request.data }}', 2.5),
        (' {{ request.data * 2 }} ', 5.0),
        ('{{ request.data }} m', '2.5 m'),
        ('{{ request.data }}{{ request.data }}', '2.52.5'),
        ({'a': ['{{ request.data > 2 }}', 1, None]}, {'a': [True, 1, None]}),
        ('{{ range(request.data | int) | list }}', [0, 1]),
        ('{{ "}}" }}', '}}'),
        ('{{ [request.data, "a"] }}', [2.5, 'a']),
    ],
)
def test_expressions_are_values(data, payload):
    assert compute_payload(data, 'request', number(2.5)) == payload


def test_fields_of_all_kinds_are_known():
    goal = scan(1.0, [0.5, 0.25], 'base')
    data = {
        'x': '{{ goal.origin.x }}',
        'near': '{{ goal.ranges | min }}',
        'text': 'in {{ goal.frame }}',
    }
    assert compute_payload(data, 'goal', goal) == {'x': 1.0, 'near': 0.25, 'text': 'in base'}


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (
            '{{ request.date }}',
            "'{{ request.date }}': the message has no attribute 'date'",
        ),
        ('{{ goal }}', "'{{ goal }}': 'goal' is undefined"),
        ('{{ request.data', "'{{ request.data': the expression has no end: '}}' is missing"),
        ('{{ request.data / 0 }}', "'{{ request.data / 0 }}': float division by zero"),
        (
            '{{ request.__class__ }}',
            "'{{ request.__class__ }}': access to attribute '__class__' of",
        ),
    ],
)
def test_an_expression_without_a_value_is_an_error(text, message):
    with pytest.raises(PayloadError, match=re.escape(message)):
        compute_payload(text, 'request', number(2.5))


def test_a_message_is_passed_on_as_it_is():
    goal = scan(1.0)
    assert compute_payload('{{ goal.origin }}', 'goal', goal) is goal.origin
    assert compute_payload('{{ [goal.origin] }}', 'goal', goal) == [goal.origin]
