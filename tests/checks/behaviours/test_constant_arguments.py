"""Constant arguments, and what cannot be called as a behaviour at all."""

import pytest

NODES = """
  n:
    parameters: {selected: {default: left, choices: [left, right]}}
    publishers: {out: {type: OUT, external: true}}
    subscriptions:
      in: {type: std_msgs/msg/String, external: true, behaviour: 'BEHAVIOUR', with: WITH, publish: out}
"""
STRING = 'std_msgs/msg/String'


def nodes_of(behaviour, arguments, out=STRING):
    texts = {'BEHAVIOUR': behaviour, 'WITH': arguments, 'OUT': out}
    nodes = NODES
    for name, text in texts.items():
        nodes = nodes.replace(name, text)
    return nodes


@pytest.mark.parametrize(
    ('behaviour', 'right', 'wrong', 'message'),
    [
        (
            'throttle',
            '{rate: 0.5}',
            '{rate: 0}',
            "behaviours.topics:throttle takes float > 0 as 'rate', and is given 0",
        ),
        (
            'drop',
            '{count: 2, of: 3}',
            '{count: 3, of: 3}',
            "behaviours.topics:drop takes int >= 0 and < 'of' (3) as 'count', and is given 3",
        ),
        (
            'mux',
            '{source: left}',
            '{source: lfet}',
            "mux compares 'source' with the parameter 'selected', which is never 'lfet'",
        ),
    ],
)
def test_shipped_behaviours_say_what_they_take(check, behaviour, right, wrong, message):
    name = f'behaviours.topics:{behaviour}'
    rule = 'bad-argument'
    assert check(nodes_of(name, right), rule=rule) == []
    assert check(nodes_of(name, wrong), rule=rule) == [message]


@pytest.mark.parametrize(
    ('behaviour', 'wrong', 'wanted'),
    [
        ('watch', '{topic: a, minimum_rate: -1}', "float >= 0 as 'minimum_rate'"),
        ('diagnose', '{topic: a, maximum_age: 0}', "float > 0 as 'maximum_age'"),
    ],
)
def test_the_monitor_says_what_it_takes(check, behaviour, wrong, wanted):
    nodes = f"""
  n:
    timers: {{t: {{period: 1, behaviour: 'behaviours.monitor:{behaviour}', with: {wrong}}}}}
"""
    messages = check(nodes, rule='bad-argument')
    assert any(f'takes {wanted}' in each for each in messages)


@pytest.mark.ros
@pytest.mark.parametrize('behaviour', ['relay', 'throttle', 'drop', 'mux'])
def test_a_message_is_passed_on_to_its_own_type(check, behaviour):
    arguments = {'throttle': '{rate: 1}', 'drop': '{count: 1, of: 2}', 'mux': '{source: left}'}
    name, given = f'behaviours.topics:{behaviour}', arguments.get(behaviour, '{}')
    rule = 'type-mismatch'
    assert check(nodes_of(name, given), rule=rule) == []
    assert check(nodes_of(name, given, 'std_msgs/msg/Int32'), rule=rule) == [
        "a std_msgs/msg/String cannot be passed on to 'out', which publishes std_msgs/msg/Int32"
    ]


@pytest.mark.parametrize(
    ('source', 'parameter', 'is_found'),
    [
        ('up', 'selected', True),
        ('left', 'selected', False),
        ('up', 'other', False),
        ('"{{ arg }}"', 'selected', False),
    ],
)
def test_the_source_of_a_mux_is_one_of_the_choices(check, source, parameter, is_found):
    nodes = nodes_of('behaviours.topics:mux', f'{{source: {source}}}')
    nodes = nodes.replace('selected:', f'{parameter}:')
    before = 'args: {arg: {type: string}}\n'
    assert len(check(nodes, before=before, rule='bad-argument')) == is_found


@pytest.mark.parametrize(
    ('behaviour', 'rule'),
    [
        ('os:system', 'uncallable-behaviour'),
        ('builtins:print', None),
        ('parts:Plain', 'bad-signature'),
        ('parts:Made', 'bad-signature'),
        ('parts:Fitting', None),
        ('parts:Inherited', None),
        ('parts:Decorated', None),
    ],
)
def test_what_takes_no_node_is_no_behaviour(check, behaviour, rule):
    code = """
        from dataclasses import dataclass
        import abc
        class Plain:
            speed = 1
        class Made:
            def __init__(self, a, b, c): ...
        class Fitting:
            def __init__(self, node): ...
        class Inherited(abc.ABC): ...
        @dataclass
        class Decorated:
            node: object
        class Dynamic:
            def __new__(cls, node): ...
        class Conditional:
            if abc:
                def __init__(self, node): ...
    """
    nodes = f'  n: {{on_start: "{behaviour}"}}\n'
    assert check(nodes, code) == ([(3, rule)] if rule else [])
