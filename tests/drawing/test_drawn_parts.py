"""What the page shows of a drawing: facts, lines and findings of each part."""

import json
import re
from xml.etree import ElementTree as ET

import pytest

from composer.page.drawn_parts import Drawing

EVIL = '</script><script>alert(1)</script><!-- <script> \u2028 ]]> @script@'
SYSTEM = f"""
    version: 1
    description: {json.dumps(EVIL)}
    nodes:
      talker:
        description: {json.dumps(EVIL)}
        publishers:
          words: {{type: std_msgs/msg/String, qos: sensor_data}}
        timers:
          t: {{rate: 1, publish: words, message: hello}}

      # Below the talker.
      ear:
        subscriptions:
          words:
            type: std_msgs/msg/String
            publish: echo

        publishers: {{echo: {{type: std_msgs/msg/String, external: true}}, other: std_msgs/msg/String}}
      {json.dumps(EVIL)}: {{}}
"""


@pytest.fixture
def data(read, needs_graphviz):
    return as_json(Drawing(*read(SYSTEM)).fold(()))


def as_json(data):
    return json.loads(json.dumps(data))


def ids_of(drawing):
    return {each.get('id') for each in ET.fromstring(drawing['svg']).iter()}


def test_texts_of_the_file_are_no_markup(data):
    assert data['parts']['n0']['facts'] == [EVIL]
    tags = {each.tag.rpartition('}')[2] for each in ET.fromstring(data['svg']).iter()}
    assert tags <= {'svg', 'g', 'path', 'polygon', 'polyline', 'ellipse', 'text', 'title'}


def test_each_part_of_the_data_is_drawn(data):
    assert set(data['parts']) == {'n0', 'n1', 'n2', 'c0', 'c1', 'c2', 'e0', 'e1', 'e2', 'e3'}
    # The ends of a topic with one publisher are drawn as the topic, a line.
    assert data['stands_in'] == {'e0': 'c0', 'e1': 'c0', 'e2': 'c1', 'xc1u': 'c1'}
    assert set(data['parts']) - set(data['stands_in']) <= ids_of(data)
    assert data['parts']['c1']['outside'] == ['xc1u', 'xtu']
    assert data['parts']['e0']['id'] == 'publisher:/talker:words'


def test_a_node_has_its_lines(data):
    ear = data['parts']['n1']
    assert (ear['kind'], ear['name']) == ('node', '/ear')
    assert ear['near'] == ['e1', 'e2', 'e3']
    (excerpt,) = ear['excerpts']
    assert (excerpt['file'], excerpt['first']) == ('robot.yaml', 12)
    assert excerpt['lines'] == [
        '  ear:',
        '    subscriptions:',
        '      words:',
        '        type: std_msgs/msg/String',
        '        publish: echo',
        '',
        '    publishers: {echo: {type: std_msgs/msg/String, external: true}, other: std_msgs/msg/String}',
    ]


def test_the_lines_of_an_entry_end_where_it_ends(data):
    (talker,) = data['parts']['n0']['excerpts']
    assert talker['lines'][-1] == '      t: {rate: 1, publish: words, message: hello}'
    (echo,) = data['parts']['e2']['excerpts']
    assert [line.strip()[:17] for line in echo['lines']] == ['publishers: {echo']


def test_a_topic_has_the_lines_of_its_ends(data):
    words = data['parts']['c0']
    assert [(each['first'], len(each['lines'])) for each in words['excerpts']] == [(7, 1), (14, 3)]
    assert words['near'] == ['e0', 'e1']


def test_an_end_tells_its_qos(data):
    assert data['parts']['e0']['name'] == 'words of node /talker'
    assert data['parts']['e0']['facts'] == ['std_msgs/msg/String', 'depth 5, best_effort']


def test_a_topic_tells_its_external_ends(data):
    assert data['parts']['c1']['name'] == '/echo'
    assert data['parts']['c1']['facts'] == ['std_msgs/msg/String', 'external subscriptions']


def test_findings_know_what_they_are_about(data):
    found = {finding['rule']: finding for finding in data['findings']}
    assert found['incompatible-qos']['part'] == 'e0'
    assert found['no-subscription']['part'] == 'c2'
    assert found['bad-name']['part'] == 'n2'
    index = data['findings'].index(found['incompatible-qos'])
    assert data['parts']['e1']['findings'] == [index]


def test_two_hundred_nodes_are_drawn(read, needs_graphviz):
    text = """
        version: 1
        nodes:
          "n_{{ r }}_{{ i }}":
            foreach: {r: "{{ range(20) }}", i: "{{ range(10) }}"}
            namespace: "/robot_{{ r }}"
            publishers: {"out_{{ i }}": std_msgs/msg/String}
            subscriptions: {in: {topic: "out_{{ (i + 3) % 10 }}", type: std_msgs/msg/String, publish: "out_{{ i }}"}}
    """
    ids = ids_of(Drawing(*read(text)).fold(()))
    assert sum(bool(re.fullmatch(r'n\d+', each)) for each in ids if each) == 200
    assert sum(bool(re.fullmatch(r'c\d+', each)) for each in ids if each) == 200
    assert not any(re.fullmatch(r'e\d+', each) for each in ids if each)


def test_many_nodes_are_drawn_with_their_names_alone(read, needs_graphviz):
    text = """
        version: 1
        nodes:
          "n_{{ i }}":
            foreach: {i: "{{ range(%d) }}"}
            publishers: {"out_{{ i }}": std_msgs/msg/String, all: std_msgs/msg/String}
            subscriptions: {in: {topic: "out_{{ (i + 3) %% 10 }}", type: std_msgs/msg/String, publish: "out_{{ i }}"}}
    """
    for size, is_shown in ((10, True), (20, False)):
        drawing = Drawing(*read(text % size)).fold(())
        document = ET.fromstring(drawing['svg'])
        texts = {each.text for each in document.iter('{http://www.w3.org/2000/svg}text')}
        assert {'n_3', '/all', '/out_3'} <= texts
        assert {'std_msgs/msg/String' in texts, 'local' in texts} == {is_shown}


FOLDABLE = """
    version: 1
    nodes:
      left: {namespace: /a/b, publishers: {one: &topic {topic: /one, type: std_msgs/msg/String, external: true}, two: {topic: /two, type: std_msgs/msg/String}}}
      right: {namespace: /a, publishers: {one: *topic, two: {topic: /two, type: std_msgs/msg/String}}}
      ear: {namespace: /c, subscriptions: {one: *topic, two: {topic: /two, type: std_msgs/msg/String, behaviour: 'x:y'}}}
      inner: {namespace: /a/b, publishers: {own: std_msgs/msg/String}, subscriptions: {own: {type: std_msgs/msg/String, behaviour: 'x:y'}}}
"""


@pytest.mark.parametrize(
    ('folded', 'boxes', 'lines'),
    [
        (['box:/a/b'], {'box:/a/b'}, set()),
        (['box:/a'], {'box:/a'}, {('2 publishers',)}),
        (['box:/a/b', 'box:/a'], {'box:/a'}, {('2 publishers',)}),
        (['box:/c', 'box:/nothing'], {'box:/c'}, set()),
    ],
    ids=str,
)
def test_a_folded_box_stands_for_what_is_in_it(read, needs_graphviz, folded, boxes, lines):
    data = as_json(Drawing(*read(FOLDABLE)).fold(folded))
    parts, drawn = data['parts'], ids_of(data)
    shown = {token: data['stands_in'].get(token, token) for token in parts}
    assert set(shown.values()) <= drawn
    assert drawn & set(data['stands_in']) == set()
    assert {part['id'] for part in parts.values() if part.get('folded')} == boxes
    assert {tuple(part['facts']) for token, part in parts.items() if token[0] == 'm'} == lines
    # The border is crossed by what has one end in it.
    for box in (part for part in parts.values() if 'members' in part):
        for token in parts:
            if token[0] == 'e':
                inside = [end in box['members'] for end in parts[token]['near']]
                assert (token in box['near']) == (sum(inside) == 1)


def test_the_lines_of_a_folded_box_to_the_outside_are_one(read, needs_graphviz):
    text = """
        version: 1
        nodes:
          talker:
            namespace: /a
            publishers: {one: &type {type: std_msgs/msg/String, external: true}, two: *type}
    """
    parts = Drawing(*read(text)).fold(['box:/a'])['parts']
    (line,) = (part for token, part in parts.items() if token[0] == 'm')
    assert line['name'] == '/a to external subscriptions'
    assert line['facts'] == ('2 publishers',)
