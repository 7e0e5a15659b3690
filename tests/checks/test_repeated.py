"""What holds for each instance of an entry is said once, with how many there are."""

import pytest

WHEELS = """
  "{side}_wheel_{{{{ i }}}}":
    foreach: {{i: "{{{{ range({count}) }}}}"}}
    {body}
"""


def find(check, rule, body, count=3):
    return check(WHEELS.format(side='left', count=count, body=body), rule=rule)


@pytest.mark.parametrize(
    ('rule', 'body', 'message'),
    [
        (
            'unknown-publisher',
            'timers: {tick: {rate: 1, publish: x, message: {}}}',
            "node 'left_wheel_0' declares no publisher 'x'",
        ),
        (
            'no-subscription',
            'publishers: {"speed_{{ i }}": std_msgs/msg/Float64}',
            "nothing in this system subscribes to '/speed_0'",
        ),
        (
            'bad-parameter',
            'parameters: {"p{{ i }}": {default: "x{{ i }}", type: integer}}',
            "parameter 'p0': expected an integer, got 'x0'",
        ),
    ],
)
def test_a_finding_of_all_instances_is_one(check, rule, body, message):
    assert find(check, rule, body, 1) == [message]
    assert find(check, rule, body, 40) == [f'{message} (and the same for 39 more instances)']


def test_what_differs_otherwise_stays(check):
    # Twice two findings at one place, about two parameters of a function.
    code = 'def tick(node, a, b): ...'
    body = 'timers: {tick: {rate: 1, behaviour: parts:tick}}'
    (message,) = check(WHEELS.format(side='left', count=2, body=body), code, rule='bad-signature')
    assert message.endswith("missing a required argument: 'a'")
    nodes = """
  left: {timers: {tick: {rate: 1, publish: x, message: {}}}}
  right: {timers: {tick: {rate: 1, publish: x, message: {}}}}
"""
    assert len(check(nodes, rule='unknown-publisher')) == 2


def test_values_that_are_wrong_each_in_its_own_way_stay(check):
    nodes = """
  "wheel_{{ i.name }}":
    foreach: {i: [{name: left, size: small}, {name: right, size: large}]}
    parameters: {size: {default: "{{ i.size }}", choices: [tiny]}}
"""
    assert len(check(nodes, rule='bad-parameter')) == 2
