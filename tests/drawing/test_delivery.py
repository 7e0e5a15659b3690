"""Which way messages, calls and goals go, as the drawing says it."""

import json

import pytest

from composer.drawing import render_picture

TOPIC = """
    version: 1
    {top}
    nodes:
      talker:
        publishers: {{words: {{type: std_msgs/msg/String, {publisher}}}}}
        timers: {{t: {{rate: 1, publish: words, message: hello}}}}
      ear:
        subscriptions: {{words: {{type: std_msgs/msg/String, publish: echo, {subscription}}}}}
        publishers: {{echo: {{type: std_msgs/msg/String, external: true}}}}
"""
CALLS = """
    version: 1
    {top}
    nodes:
      server:
        services: {{add: {{type: std_srvs/srv/Trigger, behaviour: parts:add, {service}}}}}
        actions: {{go: {{type: test_msgs/action/Fibonacci, behaviour: parts:go}}}}
      client:
        {client}
        service_clients: {{add: std_srvs/srv/Trigger}}
        action_clients: {{go: test_msgs/action/Fibonacci}}
"""
OFF = 'local_delivery: false'


def ways(picture):
    """Return the way and the reason of each edge."""
    edges = json.loads(render_picture(picture, 'json'))['edges']
    return {each['id']: (each['delivery'], each['delivery_reason']) for each in edges}


@pytest.mark.parametrize(
    ('publisher', 'subscription', 'way'),
    [
        ('', '', ('local', '')),
        ('qos: {history: keep_all}', '', ('local', '')),
        ('local_delivery: true', 'read_only: true', ('local', '')),
        ('local_delivery: false', '', ('sent', OFF)),
        ('external: true', '', ('sent', 'external: true')),
        ('qos: {durability: transient_local}', '', ('sent', 'durability: transient_local')),
        ('', 'qos: system_default', ('sent', 'durability: system_default')),
        ('qos: {deadline: 1}', 'qos: {deadline: 1}', ('sent', 'deadline')),
        ('', 'qos: {liveliness: manual_by_topic}', ('', '')),
    ],
)
def test_the_way_of_messages(draw, publisher, subscription, way):
    text = TOPIC.format(top='', publisher=publisher, subscription=subscription)
    found = ways(draw(text))
    assert found['publisher:/talker:words'] == way
    assert found['subscription:/ear:words'] == way
    assert found['publisher:/ear:echo'] == ('sent', 'external: true')


@pytest.mark.parametrize(
    ('changed', 'service', 'action'),
    [
        ({}, ('local', ''), ('local', '')),
        ({'top': 'defaults: {local_delivery: false}'}, ('sent', OFF), ('sent', OFF)),
        ({'client': 'local_delivery: false'}, ('sent', OFF), ('sent', OFF)),
        (
            {'service': 'qos: {durability: transient_local}'},
            ('sent', 'durability: transient_local'),
            ('local', ''),
        ),
    ],
)
def test_the_way_of_calls_and_goals(draw, changed, service, action):
    text = CALLS.format(**{'top': '', 'service': '', 'client': '', **changed})
    found = ways(draw(text))
    assert found['service:/server:add'] == found['service client:/client:add'] == service
    assert found['action:/server:go'] == found['action client:/client:go'] == action


def test_arrows_say_the_way_but_to_the_outside(draw):
    text = TOPIC.format(top='', publisher=OFF, subscription='')
    for form in ('mermaid', 'dot'):
        drawn = render_picture(draw(text), form)
        assert drawn.count('sent, local_delivery: false') == 1
        assert 'external: true' not in drawn


@pytest.mark.ros
def test_the_drawing_and_a_running_publisher_agree():
    pytest.importorskip('rclpy')
    from composer.language.parsing.entry_parser import parse_entity_qos
    from composer.language.qos import resolve_qos, why_sent
    from composer.runtime.messages import delivery_policies
    from composer.runtime.messages.qos_profiles import create_qos_profile

    policies = [
        *({'durability': each} for each in ('system_default', 'volatile', 'transient_local')),
        *({'history': each} for each in ('system_default', 'keep_last', 'keep_all')),
        *({'reliability': each} for each in ('system_default', 'reliable', 'best_effort')),
        *({'liveliness': each} for each in ('system_default', 'automatic', 'manual_by_topic')),
        *({each: 'best_available'} for each in ('durability', 'reliability', 'liveliness')),
        *({each: 1.5} for each in ('deadline', 'lifespan', 'liveliness_lease_duration')),
        *({each: 'infinite'} for each in ('deadline', 'lifespan')),
        *({'profile': each} for each in ('sensor_data', 'system_default', 'best_available')),
    ]
    for each in policies:
        spec = parse_entity_qos({'qos': each}, ())
        running = delivery_policies.why_sent(create_qos_profile(spec, {}))
        assert why_sent(resolve_qos(spec, {})) == running, each


SPLIT = """
    version: 1
    nodes:
      talker:
        {talker}
        publishers: {{words: std_msgs/msg/String}}
        timers: {{t: {{rate: 1, publish: words, message: hello}}}}
        services: {{add: {{type: std_srvs/srv/Trigger, behaviour: parts:add}}}}
      near:
        {talker}
        subscriptions: {{words: {{type: std_msgs/msg/String, behaviour: parts:hear}}}}
      far:
        {far}
        subscriptions: {{words: {{type: std_msgs/msg/String, behaviour: parts:hear}}}}
        service_clients: {{add: std_srvs/srv/Trigger}}
"""


@pytest.mark.parametrize(
    ('talker', 'far', 'way'),
    [
        ('worker: a', 'worker: a', ('local', '')),
        ('host: a', 'host: a', ('local', '')),
        ('worker: a', 'worker: b', ('sent', 'other worker')),
        ('worker: a', 'worker: ""', ('sent', 'other worker')),
        ('host: a', 'host: b', ('sent', 'other host')),
        ('{worker: a, host: a}', '{worker: b, host: b}', ('sent', 'other host')),
    ],
)
def test_what_crosses_between_workers_and_hosts_is_sent(draw, talker, far, way):
    lines = (each.strip('{}').replace(', ', '\n        ') for each in (talker, far))
    found = ways(draw(SPLIT.format(talker=next(lines), far=next(lines))))
    # The middleware cannot send to one subscription only.
    assert set(found.values()) == {way}
    assert len(found) == 5
