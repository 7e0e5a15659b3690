"""Events and messages as text: one line, all digits, the same on every machine."""

import math
from textwrap import indent

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.simulation.events import Event
from composer.simulation.trace import render_event, render_value


@pytest.mark.parametrize(
    ('value', 'text'),
    [
        (None, 'null'),
        (True, 'true'),
        (-3, '-3'),
        (0.1, '0.1'),
        (-0.0, '-0.0'),
        (1e-7, '1e-07'),
        ([math.nan, math.inf, -math.inf], '[.nan, .inf, -.inf]'),
        ('grün', '"grün"'),
        ('a\nb\u2028\x1b[0m"', '"a\\nb\\u2028\\u001b[0m\\""'),
        ({'a': 1, 'b c': [1, 'x'], 3: {}}, '{a: 1, "b c": [1, "x"], 3: {}}'),
        (('succeeded', 1), '["succeeded", 1]'),
        ({'b', 'a'}, '["a", "b"]'),
        (b'\x07', '7'),
        (bytes(3), '[0, 0, 0]'),
        (bytes(65), '!!binary ' + 'AAAA' * 21 + 'AAA='),
        (object(), '<object>'),
    ],
)
def test_plain_data_are_yaml(value, text):
    assert render_value(value) == text


@given(st.floats())
def test_a_number_has_all_its_digits(number):
    text = render_value(number)
    read = float(text.replace('.inf', 'inf').replace('.nan', 'nan'))
    assert read == number or (math.isnan(read) and math.isnan(number))
    assert math.isnan(number) or math.copysign(1, read) == math.copysign(1, number)


@given(st.text())
def test_text_stays_on_one_line(text):
    rendered = render_value(text)
    assert len(rendered.splitlines()) == 1
    assert rendered.encode()


# An error that another one caused, up to its own name.
CAUSE = """Traceback (most recent call last):
  File "/home/me/a.py", line 1, in f
    raise ValueError('no')
ValueError: no

Traceback (most recent call last):
  File "/home/me/b.py", line 2, in g
    raise SystemExit(3)
"""


@pytest.mark.parametrize(
    ('event', 'line'),
    [
        (Event(2_050_000_000, 'state', '/n', 'state', 'active'), '2.050000000 state /n state "active"'),
        (Event(0, 'exit', '', '', 3), '0.000000000 exit - - 3'),
        (
            Event(7, 'error', '/n', "timer 'tick'", 'Traceback …\n  File "/home/me/a.py"\nValueError: no\n'),
            '0.000000007 error /n timer \'tick\' "ValueError: no"',
        ),
        (
            Event(0, 'error', '/n', 'on_start', f'{CAUSE}SystemExit: 3\nhelp: a note of it\n'),
            '0.000000000 error /n on_start "SystemExit: 3"',
        ),
        (
            Event(0, 'log', '/n', 'error', f'a call failed\n{indent(CAUSE, "  ")}  SystemExit: 3'),
            '0.000000000 log /n error "a call failed\\n  ValueError: no\\n\\n  SystemExit: 3"',
        ),
        (Event(0, 'log', '/n', 'info', 'no Traceback\n  of it'), '0.000000000 log /n info "no Traceback\\n  of it"'),
    ],
)  # fmt: skip
def test_an_event_is_a_line(event, line):
    assert render_event(event) == line


@pytest.mark.ros
def test_messages_have_all_their_fields():
    from geometry_msgs.msg import Twist, Vector3
    from sensor_msgs.msg import JointState

    assert render_value(Twist(linear=Vector3(x=0.1))) == (
        '{linear: {x: 0.1, y: 0.0, z: 0.0}, angular: {x: 0.0, y: 0.0, z: 0.0}}'
    )
    assert render_value(JointState(name=['a'], position=[1.0, math.nan])) == (
        '{header: {stamp: {sec: 0, nanosec: 0}, frame_id: ""}, name: ["a"], '
        'position: [1.0, .nan], velocity: [], effort: []}'
    )
