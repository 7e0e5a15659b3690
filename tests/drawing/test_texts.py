"""The forms that are languages of others: whatever a name holds, it stays text."""

import html
import json
import re
import xml.etree.ElementTree as ET

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from composer.drawing import render_picture
from composer.errors import ComposerError
from composer.yaml_text.writer import render_yaml

SYSTEM = """
    version: 1
    nodes:
      lidar:
        namespace: /robot/front
        publishers: {scan: {type: std_msgs/msg/String, qos: sensor_data}}
        timers: {t: {rate: 1, publish: scan, message: hello}}
      mapper:
        namespace: /robot
        subscriptions: {front/scan: {type: std_msgs/msg/String, publish: map}}
        publishers: {map: {type: std_msgs/msg/String, external: true}}
      alone:
        publishers: {lonely: std_msgs/msg/String}
        timers: {t: {rate: 1, publish: lonely, message: hello}}
        wait_for: [{node: /robot/mapper}]
"""
EVIL = 'x"] --> <script>alert(1)</script> & %%{init} `b` \\N \\" |c| ; end #quot; ]]> -->'


def test_mermaid(draw):
    assert render_picture(draw(SYSTEM), 'mermaid').splitlines() == [
        'flowchart LR',
        '  n2(["alone"]):::node',
        '  c2["/lonely<br/>std_msgs/msg/String<br/>warning: nothing in this system subscribes<br/>to \'/lonely\'"]:::warning',
        '  xtu(("external subscriptions")):::external',
        '  subgraph g0["/robot"]',
        '    n1(["mapper"]):::node',
        '    subgraph g1["/robot/front"]',
        '      n0(["lidar"]):::node',
        '    end',
        '  end',
        "  n0 -->|\"/robot/front/scan<br/>std_msgs/msg/String<br/>depth 5, best_effort<br/>error: on topic '/robot/front/scan' the QoS<br/>of publisher 'scan' of node 'lidar' and of<br/>subscription 'front/scan' of node 'mapper'<br/>never match: reliability: best_effort is<br/>offered, reliable is requested\"| n1",
        '  n1 -.->|"/robot/map<br/>std_msgs/msg/String"| xtu',
        '  n2 --> c2',
        '  n1 -.->|"before"| n2',
        '  linkStyle 0 stroke:#d1242f,stroke-width:3px,color:#d1242f',
        '  classDef node stroke-width:2px',
        '  classDef process stroke-width:2px,stroke-dasharray:6 3',
        '  classDef external stroke-dasharray:3 3',
        '  classDef error stroke:#d1242f,stroke-width:3px',
        '  classDef warning stroke:#bf8700,stroke-width:3px',
    ]


def test_dot(draw):
    lines = [line.strip() for line in render_picture(draw(SYSTEM), 'dot').splitlines()]
    assert [line.partition(' [')[0] for line in lines] == [
        'digraph "robot" {',
        *('graph', 'node', 'edge', 'n2', 'c2', 'xtu', 'subgraph cluster_g0 {', 'graph'),
        *('n1', 'subgraph cluster_g1 {', 'graph', 'n0', '}', '}'),
        *('n0 -> n1', 'n1 -> xtu', 'n2 -> c2', 'n1 -> n2', '}'),
    ]
    assert lines[4] == (
        'n2 [label=<<B>alone</B>>, shape=ellipse, style=filled, fillcolor="#ddf4ff", '
        'color="#0969da", id="n2", class="node"]'
    )
    assert 'class="topic error"' in lines[15]
    assert 'class="topic warning"' in lines[5]


def test_clients_and_servers_elsewhere_stand_on_their_side(external_ends):
    lines = render_picture(external_ends, 'mermaid').splitlines()
    assert [line.strip() for line in lines if '-.->' in line] == [
        'n0 -.->|"/x<br/>std_msgs/msg/String"| xtu',
        'xtp -.->|"/y<br/>std_msgs/msg/String"| n0',
        'c2 -.-> xsp',
    ]


def with_name(text):
    """Return a system with a node, a process, a description and a type of this text."""
    data = {
        'version': 1,
        'description': text,
        'nodes': {text: {'publishers': {'x': text}, 'description': text}},
        'processes': {text: {'command': ['a']}},
    }
    return render_yaml(data)


def labels_of_mermaid(text):
    """Return the quoted texts, and fail if anything else could be one."""
    for line in text.splitlines():
        assert line.count('"') in (0, 2)
    labels = re.findall('"(.*?)"', text)
    assert not any(set(label.replace('<br/>', '')) & set('<>&"`|[]{}%\\') for label in labels)
    return [re.sub(r'#(\d+);', lambda match: chr(int(match[1])), label) for label in labels]


# Labels of HTML keep their brackets in pairs, and what they hold is XML.
LABEL = re.compile(r'label=<((?:[^<>]|<[^<>]*>)*)>')


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    max_examples=25,
)
@given(text=st.text(min_size=1, max_size=20))
def test_any_name_stays_text_in_dot_and_mermaid(draw, text):
    picture = draw(with_name(text))
    labels_of_mermaid(render_picture(picture, 'mermaid'))
    for line in render_picture(picture, 'dot').splitlines():
        rest = LABEL.sub('', line)
        assert '<' not in rest
        for label in LABEL.findall(line):
            ET.fromstring(f'<label>{label}</label>')


def test_svg_is_xml_with_the_names_as_they_are(draw, needs_graphviz):
    root = ET.fromstring(render_picture(draw(with_name(EVIL)), 'svg'))
    texts = [each.text or '' for each in root.iter('{http://www.w3.org/2000/svg}text')]
    assert EVIL in texts
    titles = [each.text for each in root.iter('{http://www.w3.org/2000/svg}title')]
    assert any(title.startswith(f'node /{EVIL}\n') for title in titles)
    assert not list(root.iter('{http://www.w3.org/2000/svg}script'))


def test_svg_has_an_element_for_each_part(draw, needs_graphviz):
    root = ET.fromstring(render_picture(draw(SYSTEM), 'svg'))
    classes = {each.get('id'): each.get('class') for each in root.iter() if each.get('id')}
    assert classes['c0'] == 'edge topic error'
    assert classes['c1'] == 'edge external'
    assert classes['c2'] == 'node topic warning'
    assert classes['n0'] == 'node node'
    assert {'g0', 'g1', 'n1', 'n2', 'xtu', 'e3'} <= set(classes)


def test_svg_tells_all_of_a_part_where_the_pointer_rests(draw, needs_graphviz):
    text = html.unescape(render_picture(draw(SYSTEM), 'svg'))
    assert '<title>topic /robot/front/scan\nstd_msgs/msg/String</title>' in text
    assert '<title>publisher lonely of node /alone\nstd_msgs/msg/String</title>' in text
    assert '<title>topic /robot/map\nstd_msgs/msg/String\nexternal subscriptions</title>' in text


def test_without_graphviz_it_says_how_to_get_it(draw, monkeypatch):
    monkeypatch.setattr('shutil.which', lambda name: None)
    monkeypatch.setattr('importlib.util.find_spec', lambda name: None)
    with pytest.raises(ComposerError, match='laid out by Graphviz, which is not') as caught:
        render_picture(draw(SYSTEM), 'svg')
    assert "pip install 'rclpy-composer[graph]'" in caught.value.help


BOTH = 'std_msgs/msg/String'
TALKING = """
    version: 1
    nodes:
      talker: {{publishers: {{words: {publisher}}}}}
      {others}
"""
EAR = '{subscriptions: {words: {type: std_msgs/msg/String, behaviour: "x:y"}}}'


@pytest.mark.parametrize(
    ('publisher', 'others', 'lines'),
    [
        (BOTH, [EAR], ['n0 -> n1']),
        (BOTH, [EAR, EAR], ['n0 -> n1', 'n0 -> n2']),
        (BOTH, [EAR, EAR, EAR], ['n0 -> c0', 'c0 -> n1', 'c0 -> n2', 'c0 -> n3']),
        (
            BOTH,
            [EAR, '{publishers: {words: std_msgs/msg/String}}'],
            ['n0 -> c0', 'n2 -> c0', 'c0 -> n1'],
        ),
        (f'{{type: {BOTH}, external: true}}', [EAR], ['n0 -> n1', 'n0 -> xtu']),
        (
            f'{{type: {BOTH}, external: true}}',
            [EAR, EAR],
            ['n0 -> c0', 'c0 -> n1', 'c0 -> n2', 'c0 -> xtu'],
        ),
        (BOTH, [EAR, '{wait_for: [{topic: /words}]}'], ['n0 -> c0', 'c0 -> n1', 'c0 -> n2']),
        (
            f'{BOTH}}}, subscriptions: {{words: {{type: {BOTH}, behaviour: "x:y"}}',
            [],
            ['n0 -> c0', 'c0 -> n0'],
        ),
    ],
)
def test_a_topic_of_one_publisher_and_few_subscriptions_is_a_line(draw, publisher, others, lines):
    nodes = '\n      '.join(f'n_{index}: {each}' for index, each in enumerate(others))
    text = render_picture(draw(TALKING.format(publisher=publisher, others=nodes)), 'dot')
    drawn = [line.strip().partition(' [')[0] for line in text.splitlines()]
    assert [line for line in drawn if '->' in line] == lines
    assert ('c0' in drawn) is ('n0 -> c0' in lines)


PLACED = """
    version: 1
    workers: {eyes: {host: jetson}}
    nodes:
      camera:
        worker: eyes
        namespace: /robot
        publishers: {image: std_msgs/msg/String}
        timers: {t: {rate: 1, publish: image, message: hello}}
      tracker:
        worker: eyes
        namespace: /robot
        subscriptions: {image: {type: std_msgs/msg/String, publish: out}}
        publishers: {out: std_msgs/msg/String}
      plan:
        host: jetson
        subscriptions: {/robot/out: {type: std_msgs/msg/String, publish: cmd}}
        publishers: {cmd: std_msgs/msg/String}
      drive: {subscriptions: {cmd: {type: std_msgs/msg/String, publish: done}},
              publishers: {done: {type: std_msgs/msg/String, external: true}}}
    processes: {driver: {host: jetson, command: [sleep]}}
"""


def test_hosts_and_workers_are_drawn_around_what_they_have(draw):
    text = render_picture(draw(PLACED), 'mermaid')
    drawn = [line for line in text.splitlines() if line.startswith('  ') and '--' not in line]
    shown = [line[2:].partition('["')[2].partition('"')[0] or line[2:] for line in drawn]
    inside: list[str] = []
    places = {}
    for line, name in zip(drawn, shown, strict=True):
        if 'subgraph' in line:
            inside.append(name)
        elif line.strip() == 'end':
            inside.pop()
        elif ':::' in line:
            places[line.partition('"')[2].partition('"')[0].partition('<')[0]] = [*inside]
    eyes = ['host jetson', 'worker eyes', '/robot']
    assert places == {
        'camera': eyes,
        'tracker': eyes,
        'plan': ['host jetson'],
        'driver': ['host jetson'],
        'drive': [],
        'external subscriptions': [],
    }


def test_hosts_and_workers_are_in_the_document(draw):
    nodes = json.loads(render_picture(draw(PLACED), 'json'))['nodes']
    places = {each['name']: (each['host'], each['worker']) for each in nodes}
    assert places == {
        'camera': ('jetson', 'eyes'),
        'tracker': ('jetson', 'eyes'),
        'plan': ('jetson', ''),
        'drive': ('', ''),
        'driver': ('jetson', ''),
    }
