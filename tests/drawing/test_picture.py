"""What is drawn of a system, as the JSON form shows it."""

import json

import pytest

from composer.drawing import render_picture
from composer.drawing.json_document import describe_picture

TALKER = """
    version: 1
    description: One talks, one hears.
    nodes:
      talker:
        namespace: /robot
        description: Talks.
        publishers:
          words: {type: std_msgs/msg/String, qos: sensor_data}
        timers:
          t: {rate: 1, publish: words, message: hello}
      ear:
        remap: {heard: /robot/words}
        subscriptions:
          heard: {type: std_msgs/msg/String, qos: {depth: 1, reliability: best_effort, deadline: 0.5}, publish: echo}
        publishers:
          echo: {type: std_msgs/msg/String, external: true}
"""
# The behaviours are nowhere, which is no matter of the drawing.
SERVER = """
    version: 1
    nodes:
      server:
        services: {add: {type: std_srvs/srv/Trigger, behaviour: parts:add}}
        actions: {go: {type: test_msgs/action/Fibonacci, behaviour: parts:go}}
      client:
        service_clients: {add: std_srvs/srv/Trigger}
        action_clients: {go: test_msgs/action/Fibonacci}
"""
UNMATCHED = """
    version: 1
    nodes:
      talker:
        publishers:
          words: {type: std_msgs/msg/String, qos: sensor_data}
          other: {type: std_msgs/msg/String, external: true}
        timers:
          t: {rate: 1, publish: words, message: hello}
          u: {rate: 1, publish: other, message: hello}
      ear:
        subscriptions:
          words: {type: std_msgs/msg/String, publish: echo}
        publishers:
          echo: {type: std_msgs/msg/String, external: true}
"""


def by_id(document, section):
    return {part['id']: part for part in document[section]}


def marked(document):
    """Return the rules that each marked part is marked for."""
    rules = [finding['rule'] for finding in document['findings']]
    return {
        part['id']: [rules[index] for index in part['findings']]
        for section in ('nodes', 'channels', 'edges')
        for part in document[section]
        if part['findings']
    }


def test_the_document(draw):
    document = json.loads(render_picture(draw(TALKER), 'json'))
    parts = ['nodes', 'channels', 'edges', 'waits', 'findings']
    assert list(document) == ['version', 'name', 'description', *parts]
    assert (document['version'], document['name']) == (1, 'robot')
    assert document['nodes'][0] == {
        'id': 'node:/robot/talker',
        'kind': 'node',
        'name': 'talker',
        'namespace': '/robot',
        'description': 'Talks.',
        'host': '',
        'worker': '',
        'findings': [],
        'file': 'robot.yaml',
        'line': 4,
    }
    assert document['channels'][1] == {
        'id': 'topic:/echo',
        'kind': 'topic',
        'name': '/echo',
        'types': ['std_msgs/msg/String'],
        'external': ['users'],
        'findings': [],
        'file': 'robot.yaml',
        'line': 16,
    }
    assert document['edges'][1] == {
        'id': 'subscription:/ear:heard',
        'role': 'subscription',
        'name': 'heard',
        'node': 'node:/ear',
        'channel': 'topic:/robot/words',
        'from': 'topic:/robot/words',
        'to': 'node:/ear',
        'type': 'std_msgs/msg/String',
        'qos': {'depth': 1, 'reliability': 'best_effort', 'deadline': 0.5},
        'delivery': '',
        'delivery_reason': '',
        'by_parameter': {},
        'findings': [0],
        'file': 'robot.yaml',
        'line': 14,
    }
    (finding,) = document['findings']
    assert finding.pop('message').startswith("on topic '/robot/words' the QoS of publisher")
    assert finding == {
        'rule': 'incompatible-qos',
        'severity': 'error',
        'help': 'give both the same deadline',
        'file': 'robot.yaml',
        'line': 14,
        'column': 94,
    }


def test_requests_and_goals_go_from_clients_to_servers(draw):
    edges = describe_picture(draw(SERVER))['edges']
    assert [(edge['role'], edge['from'], edge['to']) for edge in edges] == [
        ('service server', 'service:/add', 'node:/server'),
        ('service client', 'node:/client', 'service:/add'),
        ('action server', 'action:/go', 'node:/server'),
        ('action client', 'node:/client', 'action:/go'),
    ]


def test_both_ends_that_never_match_are_marked(draw):
    assert marked(describe_picture(draw(UNMATCHED))) == {
        'publisher:/talker:words': ['incompatible-qos'],
        'subscription:/ear:words': ['incompatible-qos'],
    }


def test_a_lonely_topic_is_marked_itself(draw):
    lonely = UNMATCHED.replace(', qos: sensor_data', '').replace(', external: true', '')
    assert marked(describe_picture(draw(lonely))) == {
        'topic:/other': ['no-subscription'],
        'topic:/echo': ['no-subscription'],
    }


def test_all_ends_with_another_type_are_marked(draw):
    text = """
        version: 1
        nodes:
          a:
            publishers: {x: std_msgs/msg/String}
            timers: {t: {rate: 1, publish: x, message: hello}}
          "b_{{ i }}":
            foreach: {i: [1, 2]}
            subscriptions: {x: {type: std_msgs/msg/Int32, behaviour: parts:hear}}
    """
    marks = marked(describe_picture(draw(text)))
    assert set(marks) >= {'publisher:/a:x', 'subscription:/b_1:x', 'subscription:/b_2:x'}
    assert 'topic:/x' not in marks


def test_what_is_wrong_with_a_behaviour_marks_its_node(draw):
    text = """
        version: 1
        nodes:
          a:
            publishers: {x: {type: std_msgs/msg/String, external: true}}
            subscriptions: {y: {type: std_msgs/msg/String, external: true, behaviour: nowhere:f, publish: x}}
    """
    assert marked(describe_picture(draw(text))) == {'node:/a': ['unknown-behaviour']}


def test_a_invalid_part_does_not_keep_the_rest_from_being_drawn(draw):
    document = describe_picture(draw(UNMATCHED.replace('rate: 1', 'rat: 1', 1)))
    assert 'unknown-key' in marked(document)['node:/talker']
    assert len(document['edges']) == 4


def test_processes_and_what_is_waited_for(draw):
    text = """
        version: 1
        nodes:
          a: {wait_for: [{process: driver}, {topic: elsewhere}]}
          b: {wait_for: [{service: sum}], remap: {sum: add}, namespace: /}
          c: {services: {add: {type: std_srvs/srv/Trigger, behaviour: parts:add}}}
        processes:
          driver: {command: [run], description: Theirs.}
    """
    document = describe_picture(draw(text))
    assert by_id(document, 'nodes')['process:driver']['kind'] == 'process'
    assert [(wait['node'], wait['for'], wait['line']) for wait in document['waits']] == [
        ('node:/a', 'process:driver', 3),
        ('node:/b', 'service:/add', 4),
    ]


def test_ends_that_processes_declare_are_drawn_and_marked(draw):
    text = """
        version: 1
        nodes:
          viewer:
            publishers: {copy: {type: std_msgs/msg/String, external: true}}
            subscriptions:
              image: {type: std_msgs/msg/String, publish: copy}
              words: {type: std_msgs/msg/String, publish: copy}
        processes:
          camera: {command: ['true'], publishers: {image: std_msgs/msg/String}}
          robot:
            command: ['true']
            nodes:
              speaker: {publishers: {words: std_msgs/msg/Int8}}
        containers:
          box:
            command: ['true']
            components:
              thinker: {package: a, plugin: A, publishers: {thoughts: std_msgs/msg/String}}
    """
    document = describe_picture(draw(text))
    edges = by_id(document, 'edges')
    assert edges['publisher:camera:image']['node'] == 'process:camera'
    assert edges['publisher:robot/speaker:words']['node'] == 'process:robot'
    assert edges['publisher:camera:image']['delivery'] == 'sent'
    assert edges['publisher:/thinker:thoughts']['node'] == 'node:/thinker'
    assert marked(document)['publisher:robot/speaker:words'] == ['conflicting-types']


def test_external_ends_of_either_side(external_ends):
    channels = by_id(describe_picture(external_ends), 'channels')
    assert {key: each['external'] for key, each in channels.items()} == {
        'topic:/x': ('users',),
        'topic:/y': ('providers',),
        'service:/add': ('providers',),
    }


@pytest.mark.parametrize('format_name', ['mermaid', 'dot', 'json'])
def test_the_same_file_gives_the_same_text(draw, format_name):
    assert render_picture(draw(TALKER), format_name) == render_picture(draw(TALKER), format_name)
