"""The structure of a file: what its schema says of it, in the words of the language."""

import json

import pytest
from jsonschema import Draft202012Validator

from composer.language.pipeline import load_system_text
from composer.schema import schema_path

HEAD = 'version: 1\n'
LAYERS = (
    "write 'version: 1' at the top; a layer is given after its system, as in 'composer check "
    "SYSTEM.yaml LAYER.yaml', or named under 'check:' of the system"
)


def findings(text):
    """Return rule, message, place and help of all that is wrong with the structure of a text."""
    return [
        (finding.rule, finding.message, f'{finding.span.line}:{finding.span.column}', finding.help)
        for finding in load_system_text(text).diagnostics
    ]


def node_findings(text):
    """Return the findings of a node with this content, without their places."""
    return [finding[:2] + finding[3:] for finding in findings(f'{HEAD}nodes: {{rover: {text}}}')]


def test_the_schema_is_one():
    schema = json.loads(schema_path().read_text())
    Draft202012Validator.check_schema(schema)


def test_the_schema_describes_every_key():
    def keys(schema):
        if isinstance(schema, dict):
            yield from schema.get('properties', {}).items()
            for value in schema.values():
                yield from keys(value)
        elif isinstance(schema, list):
            for value in schema:
                yield from keys(value)

    schema = json.loads(schema_path().read_text())
    undescribed = [
        name
        for name, key in keys(schema)
        # `False` forbids a key beside another one.
        if key
        and 'description' not in key
        and 'description' not in schema['$defs'].get(key.get('$ref', '').rpartition('/')[2], {})
    ]
    assert undescribed == []


def test_a_right_file_has_no_findings():
    assert findings(HEAD + 'nodes: {rover: {}}\nx-any: [thing]\n') == []


@pytest.mark.parametrize(
    ('text', 'finding'),
    [
        ('nodes: {}', ('missing-key', "the key 'version' is missing", '1:1', LAYERS)),
        (
            'version: 1',
            (
                'missing-key',
                "'nodes' or 'processes' or 'containers' or 'include' is missing",
                '1:1',
                None,
            ),
        ),
        (
            'version: 2\nnodes: {}',
            (
                'unsupported-version',
                'version 2 is not supported, only version 1',
                '1:10',
                None,
            ),
        ),
        (
            'version: "1"\nnodes: {}',
            (
                'unsupported-version',
                "version '1' is not supported, only version 1",
                '1:10',
                'write 1 without quotes: a version is a number',
            ),
        ),
        (
            HEAD + 'nodes: {}\nexecutor: {X-any: 1}',
            (
                'unknown-key',
                "unknown key 'X-any' in executor",
                '3:12',
                'the keys are: shutdown_timeout, threads',
            ),
        ),
        *(
            (
                HEAD + text,
                ('wrong-type', f"expected a mapping, got '{when}'", at, f'write {{when: {when}}}'),
            )
            for text, when, at in (
                ('nodes: {}\nworkers: {w: {restart: never}}', 'never', '3:24'),
                ('processes: {p: {command: [a], restart: always}}', 'always', '2:40'),
            )
        ),
        (HEAD + 'nodes: []', ('wrong-type', 'expected a mapping, got an empty list', '2:8', None)),
        (
            HEAD + 'nodes:\n',
            (
                'wrong-type',
                'expected a mapping, got nothing',
                '2:7',
                'write {} for an empty mapping, or remove the key',
            ),
        ),
        (
            HEAD + 'nodes: {}\nexecutor: {threads: 2000}',
            ('out-of-range', 'expected at most 1024, got 2000', '3:21', None),
        ),
    ],
)
def test_a_finding_of_the_file_is_named_and_placed(text, finding):
    assert findings(text) == [finding]


ONE_OF_LEVELS = 'expected one of debug, info, warn, error, fatal; got '
A_TYPE = 'expected a message type in full, as in std_msgs/msg/String; got '


@pytest.mark.parametrize(
    ('text', 'finding'),
    [
        (
            '{tmers: {}}',
            ('unknown-key', "unknown key 'tmers' in node 'rover'", "did you mean 'timers'?"),
        ),
        ('{log_level: loud}', ('bad-value', ONE_OF_LEVELS + "'loud'", None)),
        ('{use_sim_time: 1}', ('wrong-type', 'expected true or false, got 1', None)),
        (
            '{on_start: tick}',
            (
                'bad-value',
                "expected package.module:function, or package.module:Class.method; got 'tick'",
                None,
            ),
        ),
        (
            '{on_start: {with: {}}}',
            ('missing-key', "the key 'behaviour' is missing in behaviour 'on_start'", None),
        ),
        (
            '{publishers: {a: std_msgs/String}}',
            ('bad-value', A_TYPE + "'std_msgs/String'", "did you mean 'std_msgs/msg/String'?"),
        ),
        (
            '{publishers: {a: {type: std_msgs/srv/Empty}}}',
            ('bad-value', A_TYPE + "'std_msgs/srv/Empty'", None),
        ),
        (
            '{subscriptions: {a: {type: a/msg/B}}}',
            ('missing-key', "'behaviour' or 'publish' is missing in subscription 'a'", None),
        ),
        (
            '{subscriptions: {a: {type: a/msg/B, publish: b, with: {c: 1}}}}',
            ('missing-key', "'with' requires 'behaviour'", None),
        ),
        (
            '{timers: {a: {period: 1}}}',
            (
                'missing-key',
                "'behaviour' or 'publish' and 'message' are missing in timer 'a'",
                None,
            ),
        ),
        (
            '{timers: {a: {rate: 1, period: 1, behaviour: b:c}}}',
            (
                'conflicting-keys',
                "'period' and 'rate' cannot be used together in timer 'a'",
                'keep one of them',
            ),
        ),
        ('{timers: {a: 3}}', ('wrong-type', 'expected a mapping, got 3', None)),
        (
            '{timers: {a: {period: 1 s, behaviour: b:c}}}',
            ('wrong-type', "expected a number, got '1 s'", 'write 1'),
        ),
        (
            '{timers: {a: {period: 0, behaviour: b:c}}}',
            ('out-of-range', 'expected at least 0.000001, got 0', None),
        ),
        (
            '{timers: {a: {rate: .inf, behaviour: b:c}}}',
            ('out-of-range', 'expected at most 1000000, got inf', None),
        ),
        (
            '{publishers: {a: {type: a/msg/B, qos: {depth: 0}}}}',
            ('out-of-range', 'expected at least 1, got 0', 'write 1'),
        ),
        (
            '{parameters: {a: {type: int}}}',
            (
                'bad-value',
                'expected one of bool, integer, double, string, byte_array, bool_array, '
                "integer_array, double_array, string_array; got 'int'",
                "did you mean 'integer'?",
            ),
        ),
        (
            '{parameters: {a: {}}}',
            (
                'missing-key',
                "'default' or 'type' or 'command' or 'file' is missing in parameter 'a'",
                None,
            ),
        ),
        (
            '{parameters: {a: [[1]]}}',
            (
                'wrong-type',
                'expected true or false or a number or a string, got a list',
                'write one flat list, or a text in quotes',
            ),
        ),
    ],
)
def test_a_finding_of_a_node_is_named(text, finding):
    ((rule, message, help_text),) = node_findings(text)
    if "unknown key 'x-own'" in message:
        help_text = None  # it lists the keys
    assert (rule, message, help_text) == finding


def test_a_missing_key_is_placed_at_the_entry_that_lacks_it():
    text = HEAD + 'nodes:\n  rover:\n    publishers:\n      scan: {topic: x}\n'
    assert findings(text) == [
        ('missing-key', "the key 'type' is missing in publisher 'scan'", '5:7', None)
    ]


def test_a_finding_in_a_merged_mapping_is_placed_where_it_is_written():
    text = (
        HEAD + 'x-slow: &slow {period: slow}\n'
        'nodes: {rover: {timers: {tick: {<<: *slow, behaviour: a:b}}}}\n'
    )
    assert findings(text) == [('wrong-type', "expected a number, got 'slow'", '2:24', None)]


def test_a_misspelt_key_is_read_as_the_right_one():
    loaded = load_system_text(
        HEAD + 'nods:\n  rover:\n    timer:\n      tick: {perod: 2, behavior: a:b}\n',
    )
    assert [finding.message for finding in loaded.diagnostics] == [
        "unknown key 'nods'",
        "unknown key 'timer' in node 'rover'",
        "unknown key 'perod' in timer 'tick'",
        "unknown key 'behavior' in timer 'tick'",
    ]
    timer = loaded.spec.nodes['rover'].timers['tick']
    assert (timer.period_sec, timer.behaviour.name) == (2.0, 'a:b')
    assert loaded.dropped == frozenset()


def test_what_is_wrong_is_left_out_and_the_rest_is_read():
    loaded = load_system_text(
        HEAD + 'description: [a]\n'
        'nodes:\n'
        '  rover:\n'
        '    log_level: loud\n'
        '    publishers: {good: a/msg/B, bad: 3}\n'
        '  lander: 3\n'
    )
    assert len(loaded.diagnostics) == 4
    assert list(loaded.spec.nodes) == ['rover']
    assert list(loaded.spec.nodes['rover'].publishers) == ['good']
    assert loaded.spec.nodes['rover'].log_level is None
    assert loaded.dropped == {
        ('description',),
        ('nodes', 'rover', 'log_level'),
        ('nodes', 'rover', 'publishers', 'bad'),
        ('nodes', 'lander'),
    }


@pytest.mark.parametrize(
    ('text', 'meant'),
    [
        ('std_msgs/String', 'std_msgs/msg/String'),
        ('std_msgs.msg.String', 'std_msgs/msg/String'),
        ('std_msgs::msg::String', 'std_msgs/msg/String'),
        ('std_msgs/msgs/String', 'std_msgs/msg/String'),
        ('std_srvs/srv/Empty', None),
        ('a/b/c/String', None),
    ],
)
def test_a_type_in_the_form_of_other_places_is_understood(text, meant):
    ((_, _, help_text),) = node_findings(f'{{publishers: {{a: "{text}"}}}}')
    assert help_text == (meant and f"did you mean '{meant}'?")


@pytest.mark.parametrize(
    ('text', 'meant'),
    [
        ('robot.arm.move', 'robot.arm:move'),
        ('robot/arm.py:move', 'robot.arm:move'),
        ('robot.arm:move-up', 'robot.arm:move_up'),
        ('robot.arm::move', 'robot.arm:move'),
        ('robot.arm:move()', 'robot.arm:move'),
        ('move', None),
        ('robot:', None),
    ],
)
def test_a_behaviour_in_another_form_is_understood(text, meant):
    ((_, _, help_text),) = node_findings(f'{{on_start: {{behaviour: "{text}"}}}}')
    assert help_text == (meant and f"did you mean '{meant}'?")


def test_misspelt_keys_that_count_before_the_schema_are_one_finding_each():
    text = """
arg: {count: {defualt: 2}}
nodes:
  "wheel_{{ i }}":
    foraech: {i: "{{ range(count) }}"}
    whne: "{{ count > 1 }}"
    log_level: "{{ 'debug' if i else 'info' }}"
"""
    system = load_system_text('version: 1' + text)
    assert sorted((each.rule, each.help) for each in system.diagnostics) == [
        ('unknown-key', "did you mean 'args'?"),
        ('unknown-key', "did you mean 'default'?"),
        ('unknown-key', "did you mean 'foreach'?"),
        ('unknown-key', "did you mean 'when'?"),
    ]
    assert [node.log_level for node in system.spec.nodes.values()] == ['info', 'debug']
