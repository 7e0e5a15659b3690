"""The page stands alone, and nothing in a file becomes part of its markup."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser

import pytest

from composer.drawing import render_picture

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


class Reader(HTMLParser):
    """Takes a page apart: its elements, and the texts of scripts and styles."""

    def __init__(self, text):
        super().__init__()
        self.elements = []
        self.texts = {}
        self._inside = ''
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        self._inside = self.get_starttag_text()

    def handle_endtag(self, tag):
        self._inside = ''

    def handle_data(self, data):
        self.texts[self._inside] = self.texts.get(self._inside, '') + data

    def ids(self):
        return {attributes['id'] for _, attributes in self.elements if 'id' in attributes}

    def count(self, tag):
        return sum(tag == each for each, _ in self.elements)


@pytest.fixture
def page(draw, needs_graphviz):
    return render_picture(draw(SYSTEM), 'html')


@pytest.fixture
def reader(page):
    return Reader(page)


@pytest.fixture
def data(reader):
    return json.loads(reader.texts['<script type="application/json" id="system">'])


def test_nothing_in_it_is_fetched(page, reader):
    assert 'http' not in page.replace('http-equiv', '')
    for _, attributes in reader.elements:
        assert not {'src', 'href', 'xlink:href', 'srcset', 'action'} & set(attributes)
    assert not re.search(r'url\(|@import|fetch\(|XMLHttpRequest|import\(', page)


def test_its_policy_allows_its_own_script_and_style_alone(reader):
    (policy,) = [
        attributes['content'] for _, attributes in reader.elements if 'http-equiv' in attributes
    ]
    script, style = reader.texts['<script>'], reader.texts['<style>']

    def digest(text):
        return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()

    assert policy == (
        f"default-src 'none'; script-src 'sha256-{digest(script)}'; "
        f"style-src 'sha256-{digest(style)}'"
    )


def test_texts_of_the_file_are_no_markup(page, reader, data):
    assert reader.count('script') == 2
    assert reader.count('svg') == 1
    assert page.count('<!--') == 0
    assert data['parts']['n0']['facts'] == [EVIL]
    assert reader.texts['<p>'].strip() == EVIL


def test_each_part_of_the_data_is_drawn(reader, data):
    assert set(data['parts']) == {'n0', 'n1', 'n2', 'c0', 'c1', 'c2', 'e0', 'e1', 'e2', 'e3'}
    assert set(data['parts']) <= reader.ids()


def test_the_script_finds_what_it_asks_for(reader):
    script = reader.texts['<script>']
    asked = set(re.findall(r"getElementById\('([^']+)'\)", script))
    assert asked
    assert asked <= reader.ids()


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
    assert data['parts']['e0']['name'] == 'words of talker'
    assert data['parts']['e0']['facts'] == ['std_msgs/msg/String', 'QoS: depth 5, best_effort']


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


def data_of(page):
    return json.loads(Reader(page).texts['<script type="application/json" id="system">'])


def test_lines_that_a_setting_or_another_file_adds_are_shown_too(draw, needs_graphviz):
    setting = 'nodes.ear.log_level=debug'
    # In a line with the number of one of those in the first file.
    layer = '#\n' * 13 + 'nodes: {ear: {use_sim_time: true}}\n'
    data = data_of(render_picture(draw(SYSTEM, setting, layer=layer), 'html'))
    first, *added = data['parts']['n1']['excerpts']
    assert first['file'] == 'robot.yaml'
    assert sorted((each['file'], each['first'], each['lines']) for each in added) == [
        (f'--set {setting}', 1, [setting]),
        ('site.yaml', 14, ['nodes: {ear: {use_sim_time: true}}']),
    ]


def test_the_name_of_a_file_is_no_markup(draw, needs_graphviz):
    name = '<script>&"'
    reader = Reader(render_picture(draw(SYSTEM, name=name), 'html'))
    assert reader.count('script') == 2
    assert reader.texts['<title>'].startswith(f'{name}node')
    assert reader.texts['<h1>'] == name


def test_two_hundred_nodes_are_drawn(draw, needs_graphviz):
    text = """
        version: 1
        nodes:
          "n_{{ r }}_{{ i }}":
            foreach: {r: "{{ range(20) }}", i: "{{ range(10) }}"}
            namespace: "/robot_{{ r }}"
            publishers: {"out_{{ i }}": std_msgs/msg/String}
            subscriptions: {in: {topic: "out_{{ (i + 3) % 10 }}", type: std_msgs/msg/String, publish: "out_{{ i }}"}}
    """
    reader = Reader(render_picture(draw(text), 'html'))
    assert sum(bool(re.fullmatch(r'n\d+', each)) for each in reader.ids()) == 200
    assert sum(bool(re.fullmatch(r'e\d+', each)) for each in reader.ids()) == 400
