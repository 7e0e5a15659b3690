"""Of one finding one thing is said, and not what follows from it."""

import pytest

PUBLISHES = """
  talker:
    publishers: {chatter: std_msgs/msg/String}
    timers: {talk: {period: 1, publish: chatter, message: hello}}
"""
HEARS = """
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, behaviour: parts:hear}}
"""
CODE = """
    def hear(node, message):
        node.logger.info(str(message))
"""
SYSTEM = PUBLISHES + HEARS


def spoil(text, before, after):
    assert before in text
    return text.replace(before, after, 1)


@pytest.mark.ros
@pytest.mark.parametrize(
    ('before', 'after', 'rule'),
    [
        ('publish: chatter', 'publish: chater', 'unknown-publisher'),
        ('publish: chatter', 'publish: other', 'unknown-publisher'),
        ('subscriptions: {chatter', 'subscriptions: {"a b"', 'bad-name'),
        ('  talker:\n', '  talker:\n    remap: {chatter: a//b}\n', 'bad-name'),
        ('  talker:\n', '  talker:\n    remap: {a b: c}\n', 'bad-name'),
        ('  talker:\n', '  talker:\n    namespace: a b\n', 'bad-name'),
        ('  talker:\n', '  talker:\n    namespace: 5\n', 'wrong-type'),
        ('{chatter: std_msgs/msg/String}', '{chatter: std_msgs/msg/Strin}', 'unknown-type'),
    ],
)
def test_a_finding_is_said_alone(check, before, after, rule):
    found = check(spoil(SYSTEM, before, after), CODE)
    assert [each for _, each in found] == [rule]


def test_what_is_meant_by_a_misspelt_name_is_used(check):
    nodes = """
  n:
    parameters: {speed: 1, colour: red}
    publishers: {status: {type: std_msgs/msg/String, external: true}}
    service_clients: {reset: {type: std_srvs/srv/Empty, external: true}}
    timers: {tick: {period: 1, behaviour: parts:tick}}
"""
    code = """
        def tick(node):
            node.publish('statsu', node.parameters.sped)
            node.call('rest', None)
    """
    assert sorted(check(nodes, code, installed=False)) == [
        (3, 'unknown-parameter'),
        (3, 'unknown-publisher'),
        (4, 'unknown-service-client'),
        (4, 'unused-parameter'),
    ]


@pytest.mark.ros
def test_a_bad_name_hides_only_ends_of_its_type(check):
    other = """
  other:
    subscriptions: {numbers: {type: std_msgs/msg/Int32, behaviour: parts:hear}}
"""
    found = check(spoil(SYSTEM, 'publishers: {chatter', 'publishers: {"a b"') + other, CODE)
    assert sorted(found) == [(4, 'bad-name'), (5, 'unknown-publisher'), (11, 'no-publisher')]


@pytest.mark.parametrize('qos', ['nowhere', '{profile: nowhere, depth: 3}'])
def test_a_qos_with_an_unknown_profile_matches_everything(check, qos):
    talker = f"""
  talker:
    publishers: {{numbers: {{type: std_msgs/msg/Int32, qos: {qos}}}}}
    timers: {{tick: {{period: 1, publish: numbers, message: {{data: 1}}}}}}
  hearer:
    publishers: {{copies: {{type: std_msgs/msg/Int32, external: true}}}}
    subscriptions:
      numbers: {{type: std_msgs/msg/Int32, publish: copies, qos: {{durability: transient_local}}}}
"""
    assert check(talker, installed=False) == [(4, 'unknown-qos-profile')]


def test_a_module_that_is_not_python_is_one_finding(check):
    nodes = """
  n:
    timers:
      a: {period: 1, behaviour: parts:one}
      b: {period: 1, behaviour: parts:two}
  m:
    on_start: parts:one
"""
    assert check(nodes, 'def one(:\n    pass\n') == [(1, 'broken-module')]


@pytest.mark.parametrize(
    ('key', 'hides'), [('timmers', False), ('paramters', True), ('anything', True)]
)
def test_a_misspelt_key_hides_only_what_it_may_have_declared(check, key, hides):
    nodes = f"""
  n:
    parameters: {{speed: 1}}
    timers: {{b: {{period: 1, behaviour: parts:tick}}}}
    {key}: {{}}
"""
    code = """
        def tick(node):
            return node.parameters.spede
    """
    found = {rule for _, rule in check(nodes, code)}
    assert ('unknown-parameter' in found) is not hides
    assert 'unknown-key' in found
