"""The page of a running system: what it shows, in a real browser, and what it refuses."""

import base64
import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import textwrap
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip('rclpy')
pytest.importorskip('starlette')
pytest.importorskip('uvicorn')

from composer.application.running_systems.health import read_health
from composer.cli.main import run
from composer.page import watched_system
from composer.page.drawn_parts import draw_files
from composer.page.looks import Recording, show_small
from composer.page.problems import list_problems
from composer.page.watched_system import WatchedSystem
from tests.running import DEADLINE_SEC, wait_for

pytestmark = pytest.mark.ros

AXE = Path(pytest.importorskip('axe_core_python').__file__).parent / 'axe.min.js'
EVIL = '<img src=x onerror=alert(1)>'
SYSTEM = f"""
version: 1
description: "{EVIL}"
nodes:
  talker:
    namespace: /left
    parameters: {{gain: {{default: 1.5, maximum: 5.0, description: "{EVIL}"}}}}
    publishers: {{words: std_msgs/msg/String}}
    timers: {{say: {{rate: 10, behaviour: 'parts:say', publish: words}}}}
    services: {{switch: {{type: std_srvs/srv/SetBool, behaviour: 'parts:switch'}}}}
  ear:
    subscriptions: {{words: {{topic: /left/words, type: std_msgs/msg/String, behaviour: 'parts:hear'}}}}
"""
CODE = f"""
def say(node):
    return '{EVIL}' + '.' * round(node.parameters.gain)

def switch(node, request):
    return {{'success': request.data, 'message': '{EVIL}'}}

def hear(node, message):
    node.state.count = node.state.count + 1 if hasattr(node.state, 'count') else 1
    node.logger.warn('{EVIL}', throttle_duration_sec=0.5)
    raise ValueError('{EVIL}')
"""


_pages = []


class Page:
    """A page that is served, and its cookie."""

    def __init__(self, domain_id, *words, folder=None):
        self.domain_id = domain_id
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain_id)}
        self.process = subprocess.Popen(
            [sys.executable, '-m', 'composer', 'page', '--no-browser', *words],
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            env=environment,
        )
        _pages.append(self)
        self.address = self.process.stderr.readline().strip()
        self.port = int(re.search(r':(\d+)/', self.address)[1])
        self.path = self.address.partition(str(self.port))[2]
        self.attributes = self.get(self.path)[1]['set-cookie']
        self.cookie = self.attributes.partition(';')[0]

    def get(self, path, method='GET', **headers):
        """Return the status, the headers and the body of an answer."""
        with closing(http.client.HTTPConnection('127.0.0.1', self.port, timeout=20)) as connection:
            connection.request(method, path, headers=headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read().decode()

    def told(self, path):
        """Return what is asked for; `None` if there is a problem."""
        answer = self.json(path)
        return None if 'problem' in answer else answer

    def json(self, path):
        return json.loads(self.get(path, cookie=self.cookie)[2])

    def act(self, body, **headers):
        """Return the status and the answer to a wish."""
        given = {
            'cookie': self.cookie,
            'origin': f'http://127.0.0.1:{self.port}',
            'content-type': 'application/json',
        }
        text = body if isinstance(body, str) else json.dumps(body)
        with closing(http.client.HTTPConnection('127.0.0.1', self.port, timeout=20)) as connection:
            connection.request('POST', '/api/act', text, given | headers)
            answer = connection.getresponse()
            found = answer.read().decode()
            return answer.status, found if answer.status == 403 else json.loads(found)

    @contextmanager
    def stream(self):
        """Yield the states that are sent from now on."""
        with closing(http.client.HTTPConnection('127.0.0.1', self.port, timeout=40)) as connection:
            connection.request('GET', '/api/events', headers={'cookie': self.cookie})
            with connection.getresponse() as answer:
                yield (json.loads(line[6:]) for line in answer if line.startswith(b'data: '))

    def end(self):
        """Return the exit code."""
        _pages.remove(self)
        self.process.send_signal(signal.SIGINT)
        with self.process as process:
            process.communicate(timeout=30)
        return process.returncode


@pytest.fixture(autouse=True)
def _ending():
    """End the pages of a test that has failed."""
    before = [*_pages]
    yield
    for each in [each for each in _pages if each not in before]:
        each.end()


@pytest.fixture(scope='module')
def page(shared_compose):
    child = shared_compose(SYSTEM, CODE)
    child.wait_until_ready()
    page = Page(shared_compose.domain_id, 'system')
    wait_for(lambda: page.json('/api/state').get('health'), 'the system to answer')
    yield page
    assert page.end() == 130
    assert child.stop() == 0


@pytest.fixture(scope='module')
def acting(page, shared_compose):
    options = ('system', '--allow-changes')
    acting = Page(shared_compose.domain_id, *options, folder=shared_compose.folder)
    wait_for(lambda: acting.json('/api/state').get('health'), 'the system to answer')
    yield acting
    assert acting.end() == 130


def test_it_changes_what_it_may(acting):
    # In this order: what is stopped is started again for the other tests.
    for wish, told in (
        ({'action': 'set', 'name': '/left/talker', 'parameter': 'gain', 'text': '2'}, 'gain = 2'),
        ({'action': 'call', 'name': '/left/switch', 'text': '{data: true}'}, 'success: true'),
        ({'action': 'publish', 'name': '/left/words', 'text': 'hello'}, 'to 1 subscription'),
        ({'action': 'restart', 'name': '/left/talker'}, "node '/left/talker' was restarted"),
        ({'action': 'stop', 'name': '/left/talker'}, "node '/left/talker' was stopped"),
        ({'action': 'start', 'name': '/left/talker'}, "node '/left/talker' was started"),
    ):
        status, found = acting.act(wish)
        assert (status, told in found['text']) == (200, True), found


@pytest.mark.parametrize(
    ('wish', 'status', 'told'),
    [
        (
            {'action': 'set', 'name': '/left/talker', 'parameter': 'gain', 'text': '9'},
            504,
            'gain = 9',
        ),
        (
            {'action': 'set', 'name': '/nobody', 'parameter': 'a', 'text': '9'},
            504,
            "no node '/nobody'",
        ),
        ({'action': 'call', 'name': '/left/switch', 'text': '{dta: true}'}, 504, "'dta'"),
        ({'action': 'call', 'name': '/left/switch', 'text': '{data: '}, 504, 'is no YAML'),
        ({'action': 'publish', 'name': '/nothing', 'text': ''}, 504, "no topic '/nothing'"),
        ({'action': 'stop', 'name': '/nobody'}, 504, "'/nobody' is no node"),
        ({'action': 'start', 'name': '/left/talker'}, 504, 'runs already'),
        ({'action': 'end_record'}, 504, 'nothing is recorded'),
        ({'action': 'leave'}, 504, "no action 'leave'"),
        ({'action': 3}, 400, 'mapping of texts'),
        ('[', 400, 'mapping of texts'),
        pytest.param('[' * 90_000, 400, 'mapping of texts', id='deep'),
        pytest.param('"' + 'x' * 200_000 + '"', 413, 'too long', id='long'),
    ],
    ids=str,
)
def test_what_cannot_be_changed_is_told(acting, wish, status, told):
    found = acting.act(wish)
    assert (found[0], told in found[1]['problem']) == (status, True), found


@pytest.mark.parametrize(
    'headers',
    [
        {'origin': 'http://robot.example'},
        {'origin': 'null'},
        {'content-type': 'text/plain'},
        {'cookie': ''},
        {'host': 'robot.example'},
    ],
    ids=str,
)
def test_others_change_nothing(acting, page, headers):
    wish = {'action': 'restart', 'name': '/left/talker'}
    assert acting.act(wish, **headers)[0] == 403
    assert page.act(wish)[0] == 403


def test_a_question_that_somebody_gave_up_keeps_no_other_from_an_answer(domain_id):
    source = WatchedSystem('nobody')
    source.ask(lambda client: client.domain_id).cancel()
    asked = source.ask(lambda client: client.domain_id)
    source.start()
    try:
        assert asked.result(DEADLINE_SEC) == domain_id
    finally:
        source.stop()


def test_while_nobody_looks_the_system_measures_nothing(page, monkeypatch):
    asked = []

    def read_and_note(answer):
        asked.append(answer)
        return read_health(answer)

    monkeypatch.setenv('ROS_DOMAIN_ID', str(page.domain_id))
    monkeypatch.setattr(watched_system, 'read_health', read_and_note)
    for name in ('_IDLE_SEC', '_STATUS_PERIOD_SEC'):
        monkeypatch.setattr(watched_system, name, 0.1)
    source = WatchedSystem('system')
    source.start()
    try:
        wait_for(lambda: len(asked) > 1, 'two looks at the health')
        source.looked_at = float('-inf')
        before = len(asked)
        heard = set()
        wait_for(lambda: heard.add(source.state['status']['heard']) or len(heard) > 3, 'status')
        assert len(asked) <= before + 1
        source.looked_at = float('inf')
        wait_for(lambda: len(asked) > before + 2, 'the health again')
    finally:
        source.stop()


def test_it_records(acting):
    acting.act({'action': 'record'})
    target = Path(acting.json('/api/state')['recording']['target'])
    assert 'already' in acting.act({'action': 'record'})[1]['problem']
    wait_for(lambda: any(target.glob('*.mcap')), 'the file')
    assert 'recorded' in acting.act({'action': 'end_record'})[1]['text']
    assert (target / 'metadata.yaml').is_file()
    assert acting.json('/api/state')['recording']['target'] == ''


def test_the_end_of_a_recording_says_what_was_not_recorded_too():
    recording = Recording()
    recording.info("recorded 3 messages of 1 topic to 'a'")
    recording.error('the disk was too slow: 2 more were not recorded')
    assert recording.told == (
        "recorded 3 messages of 1 topic to 'a'; the disk was too slow: 2 more were not recorded"
    )


def test_what_a_saved_edit_would_do_is_shown_before_it_is_done(acting, shared_compose):
    def next_plan():
        return acting.json('/api/state').get('next')

    def shows(**expected):
        # A file that is looked at while it is written is without its lines.
        plan = next_plan() or {'lines': [], 'findings': []}
        found = {
            'lines': [line.partition(': ')[0] for line in plan['lines']],
            'findings': [(each['rule'], each['line']) for each in plan['findings']],
        }
        return all(part in found[key] for key, part in expected.items())

    path = shared_compose.folder / 'system.yaml'
    text = SYSTEM
    # Another test of this page may have saved another.
    path.write_text(text)
    acting.act({'action': 'reload'})
    wait_for(lambda: not next_plan(), 'no plan')
    path.write_text(text.replace('rate: 10', 'rate: 20'))
    wait_for(lambda: shows(lines="~ timer 'say' of '/left/talker'"), next_plan)
    path.write_text(text.replace('publish: words', 'publish: wrds'))
    wait_for(lambda: shows(findings=('unknown-publisher', 9)), next_plan)
    path.write_text(text)
    wait_for(lambda: not next_plan(), 'no plan')
    path.write_text(text.replace('rate: 10', 'rate: 5'))
    wait_for(lambda: shows(lines="~ timer 'say' of '/left/talker'"), next_plan)
    assert '~1 timer' in acting.act({'action': 'reload'})[1]['text']
    wait_for(lambda: not next_plan(), 'no plan')
    assert '~1 timer' in acting.json('/api/state')['status']['last_reload']['message']


def test_a_page_beside_a_system_ends_with_it(compose):
    child = compose(SYSTEM, CODE, '--page')
    child.wait_until_ready()
    port = int(re.search(r':(\d+)/\?token', child.wait_for_line('token='))[1])
    socket.create_connection(('127.0.0.1', port)).close()
    assert child.stop() == 0
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(('127.0.0.1', port))


def test_the_state_says_what_is_wrong_and_where(page):
    problems = wait_for(lambda: page.json('/api/state')['problems'], 'errors')
    assert problems[0]['node'] == '/ear'
    assert 'subscription words of /ear' in problems[0]['text']
    state = page.json('/api/state')
    assert (state['runs'], sorted(state['status']['nodes'])) == (True, ['/ear', '/left/talker'])
    assert {row['node'] for row in state['health']['entities']} == {'/left/talker', '/ear'}


def entity(kind, node, **figures):
    none = dict.fromkeys(('rate_hz', 'mean_ms'))
    row = {'kind': kind, 'node': node, 'name': 'scan', 'level': 'ok', 'errors': 0, 'dropped': 0}
    return {**row, **none, **figures}


@pytest.mark.parametrize(
    ('figures', 'text'),
    [
        ({'errors': 3, 'mean_ms': 1.0}, '3 errors since the start'),
        (
            {'dropped': 4, 'mean_ms': 50.0},
            '4 messages dropped; /a publishes 30/s, and each takes 50 ms',
        ),
        ({'dropped': 4, 'mean_ms': 1.0}, '4 messages dropped; /a publishes 30/s'),
        (
            {'dropped': 4, 'level': 'warn', 'message': '4 lost', 'mean_ms': 50.0},
            '4 lost; /a publishes 30/s, and each takes 50 ms',
        ),
    ],
)
def test_drops_are_told_with_who_publishes_too_fast(figures, text):
    rows = [
        entity('publisher', '/a', rate_hz=30.0),
        entity('publisher', '/other', rate_hz=99.0),
        entity('subscription', '/b', **figures),
    ]
    topics = {f'{row["kind"]}:{row["node"]}:scan': row['node'] != '/other' for row in rows}
    (problem,) = list_problems({}, {'entities': rows}, {}, topics, {})
    assert problem == {'level': 'warn', 'text': f'subscription scan of /b: {text}', 'node': '/b'}


@pytest.mark.parametrize(
    ('rate_hz', 'status', 'is_told'),
    [
        (0.0, {}, True),
        (0.5, {}, False),
        (None, {}, False),
        (0.0, {'stopped': ['/a']}, False),
        (0.0, {'lifecycles': {'/a': 'active'}}, True),
        (0.0, {'lifecycles': {'/a': 'inactive'}}, False),
        (0.0, {'awaited': {'/a': "service '/map'"}}, False),
    ],
)
def test_a_timer_that_is_never_called_is_told(rate_hz, status, is_told):
    rows = [entity('timer', node, rate_hz=rate_hz) for node in ('/a', '/seldom')]
    rates = {'timer:/a:scan': 10.0, 'timer:/seldom:scan': 1.0}
    health = {'entities': rows, 'period_sec': 1.0}
    told = [each['text'] for each in list_problems(status, health, {}, {}, rates)]
    assert ('timer scan of /a: 0/s, where 10/s are declared' in told) is is_told
    assert not any('/seldom' in each for each in told)


def test_what_timers_are_to_do_is_read_from_the_file(tmp_path):
    text = """
        version: 1
        nodes:
          n:
            parameters: {hz: 5.0}
            publishers: {out: std_msgs/msg/String}
            timers:
              fixed: {rate: 4, publish: out, message: hello}
              plain: {period: 0.5, behaviour: 'parts:plain'}
              later: {period: 0.5, behaviour: 'parts:later'}
              steps: {period: 0.5, behaviour: 'parts:steps'}
              by: {rate: {parameter: hz}, behaviour: 'parts:plain'}
              of_class: {period: 0.5, behaviour: 'parts:Counter.tick'}
    """
    code = 'def plain(node):\n    pass\n\nasync def later(node):\n    pass\n\ndef steps(node):\n    yield\n'
    code += '\nclass Counter:\n    def tick(self):\n        pass\n'
    (tmp_path / 'system.yaml').write_text(textwrap.dedent(text))
    (tmp_path / 'parts.py').write_text(code)
    drawing = draw_files([tmp_path / 'system.yaml'], [], [])
    plain = dict.fromkeys(('timer:/n:plain', 'timer:/n:of_class'), 2.0)
    assert drawing.rates == {'timer:/n:fixed': 4.0, **plain}
    *_, method = drawing.fold()['parts']['n0']['excerpts']
    assert (method['first'], method['what']) == (11, "timer 'of_class'")
    assert method['lines'] == ('    def tick(self):', '        pass')


@pytest.mark.parametrize(
    ('wrong', 'is_shown'),
    [
        ({}, True),
        ({'encoding': 'mono8'}, True),
        ({'encoding': '32FC1'}, False),
        ({'height': 2**32 - 1}, False),
        ({'width': 2**32 - 1, 'step': 2**32 - 1}, False),
        ({'step': 11}, False),
        ({'height': 0}, False),
        ({'width': 0}, False),
        ({'data': []}, False),
    ],
    ids=str,
)
def test_only_images_with_all_their_data_are_shown_small(wrong, is_shown):
    from sensor_msgs.msg import Image

    right = {'encoding': 'rgba8', 'width': 3, 'height': 2, 'step': 13, 'data': [1, 2, 3, 4] * 7}
    small = show_small(Image(**right | wrong))
    assert (small is not None) is is_shown
    if not wrong:
        pixels = base64.b64decode(small['rgb'])
        assert pixels[:3] == b'\1\2\3'
        assert len(pixels) == 3 * small['width'] * small['height'] == 18


def test_a_stream_tells_of_changes_and_bears_who_leaves(page):
    for _ in range(12):
        with page.stream() as states:
            assert next(states)['runs']
    with page.stream() as states:
        periods = set()
        while len(periods) < 3:
            periods.add(next(states)['health']['period'])


def test_what_somebody_asks_for_is_there(page):
    # On a crowded machine, the first answer may be that none came in time.
    told = wait_for(lambda: page.told('/api/parameters?node=/left/talker'), 'parameters')
    parameters = {each['name']: each for each in told}
    assert parameters['gain']['value'] == 1.5
    assert parameters['gain']['range'][1] == 5.0
    assert (
        EVIL in wait_for(lambda: page.told('/api/message?topic=/left/words'), 'a message')['text']
    )
    assert "no topic '/nothing'" in page.json('/api/message?topic=/nothing')['problem']
    lines = wait_for(lambda: page.json('/api/log'), 'the log')
    assert EVIL in {each['text'] for each in lines}
    assert page.json(f'/api/log?after={lines[0]["number"]}')[:1] != lines[:1]
    assert page.json(f'/api/log?after={"9" * 5000}') is not None
    assert "no node 'a b'" in page.json('/api/parameters?node=a%20b')['problem']


@pytest.mark.parametrize('path', ['/', '/api/state', '/api/events', '/api/log', '/page.js'])
@pytest.mark.parametrize(
    ('headers', 'method'),
    [
        ({'cookie': ''}, 'GET'),
        ({'cookie': 'composer_page=guess'}, 'GET'),
        ({'host': 'robot.example:80'}, 'GET'),
        ({'origin': 'http://robot.example'}, 'GET'),
        ({'origin': 'null'}, 'GET'),
        ({}, 'POST'),
        ({}, 'PUT'),
    ],
    ids=str,
)
def test_what_is_not_from_its_own_browser_is_refused(page, path, headers, method):
    status, found, text = page.get(path, method, **({'cookie': page.cookie} | headers))
    assert status == 403
    assert found['content-security-policy'].startswith("default-src 'none'; ")
    assert len(text) < 100


def test_only_its_own_scripts_and_files_are_served(page):
    assert 'HttpOnly' in page.attributes
    assert 'SameSite=strict' in page.attributes
    _, headers, text = page.get('/', cookie=page.cookie)
    assert 'unsafe' not in headers['content-security-policy']
    assert not re.search(r'<script>|<style>| on\w+=|style=|https?:', text)
    for path in ('/server.py', '/../server.py', '/%2e%2e/server.py', '/page.html'):
        assert page.get(path, cookie=page.cookie)[0] == 404
    with socket.create_connection(('127.0.0.1', page.port)) as raw:
        raw.sendall(b'GET / HTTP/1.1\r\n\r\n')
        assert b' 400 ' in raw.recv(100) or b' 403 ' in raw.recv(100)


def test_another_address_is_refused_with_the_way_round(capsys):
    assert run(['page', '--listen', '0.0.0.0']) == 2
    told = capsys.readouterr().err
    assert 'not encrypted' in told
    assert 'ssh -L' in told


def test_a_file_is_shown_that_does_not_run(page, shared_compose):
    still = Page(shared_compose.domain_id, str(shared_compose.folder / 'system.yaml'))
    state, drawing = still.json('/api/state'), still.json('/api/drawing')
    assert still.end() == 130
    assert (state['name'], state['runs'], state['drawing']) == ('system', False, 1)
    assert 'node:/ear' in {each['id'] for each in drawing['parts'].values()}
    (ear,) = (each for each in drawing['parts'].values() if each['id'] == 'node:/ear')
    assert ear['excerpts'][-1]['lines'][0] == 'def hear(node, message):'


@pytest.fixture(scope='module')
def browser():
    webdriver = pytest.importorskip('selenium.webdriver')
    # The part of Chromium that draws and runs pages takes less than all of it. Debian's command of
    # this name starts a child, which nobody would end.
    part = shutil.which('chromium-headless-shell', path='/usr/lib/chromium')
    chromium = part or shutil.which('chromium')
    if not (chromium and shutil.which('chromedriver')):
        pytest.skip('there is no Chromium')
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for each in ('--headless=new', '--no-sandbox', '--disable-gpu', '--window-size=1440,900'):
        options.add_argument(each)
    service = webdriver.ChromeService(shutil.which('chromedriver'))
    browser = webdriver.Chrome(options=options, service=service)
    yield browser
    browser.quit()


def find_all(browser, selector):
    return browser.find_elements('css selector', selector)


def click(browser, selector, text=''):
    """Click the first element with a text."""
    act_on(browser, selector, lambda element: element.click(), text)


def act_on(browser, selector, act, text=''):
    """Act on the first element with a text, once it stands still: lists are made anew all the time."""
    from selenium.common import exceptions

    moving = (
        exceptions.StaleElementReferenceException,
        exceptions.ElementClickInterceptedException,
        exceptions.ElementNotInteractableException,
    )

    def is_done():
        with suppress(*moving):
            for element in find_all(browser, selector):
                if text in element.text:
                    act(element)
                    return True
        return False

    wait_for(is_done, selector)


def read_text(browser, selector):
    return browser.execute_script(f'return document.querySelector("{selector}")?.innerText ?? ""')


def find_violations(browser, rest):
    """Return what people with some disability cannot use, but for the `rest` of the page."""
    browser.execute_script(AXE.read_text())
    found = browser.execute_async_script(
        'axe.run({exclude: arguments[0]}).then(arguments[1])', rest
    )
    return [
        (each['id'], node['html'], node['any'][:1] and node['any'][0]['message'])
        for each in found['violations']
        for node in each['nodes']
    ]


def test_what_is_older_than_two_periods_is_shown_as_old(compose, browser):
    """Each part by itself: a worker is stopped for a while, and then the whole system."""
    child = compose(
        'diagnostics: {period: 0.5}' + SYSTEM.replace('  ear:\n', '  ear:\n    worker: side\n'),
        CODE.replace("raise ValueError('" + EVIL + "')", 'pass'),
    )
    child.wait_until_ready()
    page = Page(compose.domain_id, 'system')
    everything = {'node:/ear', 'node:/left/talker', 'edge', 'row'}

    def old():
        script = """return [...document.querySelectorAll('.old')].map((each) =>
            each.dataset.id ?? (each.closest('#live') ? 'row' : each.closest('svg') ? 'edge' : each.id))"""
        return set(browser.execute_script(script)) & everything

    browser.get(page.address)
    wait_for(lambda: find_all(browser, 'main svg .node'), 'the drawing')
    browser.get(f'http://127.0.0.1:{page.port}/#node%3A%2Fear')
    wait_for(lambda: 'subscription words' in read_text(browser, '#live'), 'figures')
    wait_for(lambda: not old(), 'fresh figures')
    rows = page.json('/api/state')['health']['entities']
    assert {row['worker'] for row in rows if row['node'] == '/ear'} == {'side'}
    (worker,) = page.json('/api/state')['status']['workers']
    os.kill(worker['pid'], signal.SIGSTOP)
    try:
        wait_for(lambda: old() >= {'node:/ear', 'row'}, 'the old node')
        age = 'return document.querySelector("#tree .old")?.dataset.age ?? ""'
        wait_for(lambda: 'heard' in browser.execute_script(age), 'when it was heard')
        wait_for(lambda: old() == {'node:/ear', 'row', 'edge'}, 'what is fresh')
    finally:
        os.kill(worker['pid'], signal.SIGCONT)
    wait_for(lambda: not old(), 'fresh figures again')
    os.kill(child.pid, signal.SIGSTOP)
    try:
        wait_for(lambda: old() >= everything, 'an old page')
        # What is old is still read.
        assert find_violations(browser, []) == []
        wait_for(lambda: not page.json('/api/state')['runs'], 'the page to give up')
        number = page.json('/api/state')['drawing']
    finally:
        os.kill(child.pid, signal.SIGCONT)
    # It is drawn anew, and windows that have the old drawing can tell.
    wait_for(lambda: page.json('/api/state')['runs'], 'the system again')
    assert page.json('/api/state')['drawing'] > number > 0
    browser.get('about:blank')
    assert page.end() == 130
    assert child.stop() == 0


def test_ends_outside_appear_and_go(page, browser, shared_peer):
    """It says why no message goes to one of them, and where."""
    from rclpy.qos import qos_profile_sensor_data
    from std_msgs.msg import String

    def outside():
        return {
            topic: [(end['kind'], end['node']) for end in ends]
            for topic, ends in page.json('/api/state')['outside'].items()
        }

    find, text_of = partial(find_all, browser), partial(read_text, browser)
    browser.get(page.address)
    wait_for(lambda: find_all(browser, 'main svg .node'), 'the drawing')
    browser.get(f'http://127.0.0.1:{page.port}/#topic%3A%2Fleft%2Fwords')
    wait_for(lambda: text_of('#details h2').startswith('/left/words'), 'the topic')
    wait_for(lambda: outside() == {}, 'only ends of its own')
    assert not find('main svg .external, .outside')
    click(browser, '#message button')
    name = shared_peer.node.get_fully_qualified_name()
    publisher = shared_peer.run(
        shared_peer.node.create_publisher, String, '/left/words', qos_profile_sensor_data
    )
    wait_for(lambda: find('main svg .external.node'), 'the publisher in the graph')
    # Messages are looked at still; of a topic that seems slow, one at a time.
    assert text_of('#message button') in {'Pause', 'Go on'}
    for place in ('#live .outside', '#tree .outside'):
        wait_for(lambda place=place: name in text_of(place), place)
    assert outside() == {'/left/words': [('publisher', name)]}
    wait_for(lambda: f'gets nothing from {name}: reliability: best' in text_of('#problems'), 'why')
    assert page.json('/api/state')['outside']['/left/words'][0]['problem_at'] == '/ear'
    subscription = shared_peer.run(
        shared_peer.node.create_subscription, String, '/left/words', print, 1
    )
    wait_for(lambda: len(find('main svg .external.node')) == 2, 'the subscription in the graph')
    shared_peer.run(shared_peer.node.destroy_subscription, subscription)
    shared_peer.run(shared_peer.node.destroy_publisher, publisher)
    wait_for(lambda: not find('main svg .external, .outside'), 'nothing outside')
    assert outside() == {}


SCRIPTS = [
    '<script>window.hit = 1</script>',
    '<img src=x onerror="window.hit = 1">',
    '<svg onload="window.hit = 1"></svg>',
    '"><iframe srcdoc="<script>parent.hit = 1</script>"></iframe>',
    '<a href="javascript:window.hit = 1">here</a>',
    '</pre></li></ul><style>* {display: none}</style>',
    "'; window.hit = 1; //",
    '${window.hit = 1}',
    '{{window.hit = 1}}',
    '&lt;script&gt; &amp; &#60;',
    ']]><!-- <![CDATA[ -->',
    '__proto__',
    'a: b\n---\n- !!python/object:os.system {}',
    '%s%n%00/../../etc',
]
# What is not visible, and how it is shown.
CONTROLS = [0x1B, 0x08, 0x0D, 0x7F, 0x9B, 0x200B, 0x200F, 0x202E, 0x2028, 0x2066, 0xFEFF]


def look_at_messages(browser, is_shown):
    """Have the page ask for messages until what is wanted is shown."""
    click(browser, '#message button')

    def is_there():
        # On a crowded machine none may come in time, and the page asks for no more.
        if read_text(browser, '#message button') == 'Go on':
            click(browser, '#message button')
        return is_shown()

    wait_for(is_there, 'the message')


def look_at_picture(peer, browser, port):
    """Publish a red image, and see that it is red on the page."""
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import Image

    picture = Image(encoding='bgr8', width=400, height=200, step=1200, data=[0, 0, 255] * 80_000)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = peer.advertise(Image, '/picture', latched)
    publisher.publish(picture)
    browser.get(f'http://127.0.0.1:{port}/#topic%3A%2Fpicture')
    pixel = """const [canvas] = document.getElementsByTagName('canvas');
        return canvas && !canvas.hidden && [canvas.width, canvas.height,
            ...canvas.getContext('2d').getImageData(9, 9, 1, 1).data]"""
    red = [134, 67, 255, 0, 0, 255]
    look_at_messages(browser, lambda: browser.execute_script(pixel) == red)


def test_hostile_texts_stay_text(compose, browser, peer):
    """Payloads, log lines and names, values of parameters and errors of calls: 36 and more."""
    from rcl_interfaces.msg import Log
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from sensor_msgs.msg import JointState

    texts = SCRIPTS + [f'{script}{chr(code)}end' for code in CONTROLS for script in SCRIPTS[:2]]
    shown = SCRIPTS + [f'{script}\\u{code:04x}end' for code in CONTROLS for script in SCRIPTS[:2]]
    assert len(texts) == 36
    long = SCRIPTS[1] + 'x' * 200_000
    system = """
        version: 1
        nodes:
          ear:
            parameters: {texts: {default: ['']}, long: {default: ''}}
            subscriptions:
              names: {topic: /names, type: sensor_msgs/msg/JointState, behaviour: 'parts:hear', external: true}
              picture: {topic: /picture, type: sensor_msgs/msg/Image, behaviour: 'parts:see', external: true}
    """
    code = (
        'def hear(node, message):\n    raise ValueError(message.name[0])\n\n\n'
        'def see(node, message):\n    pass\n'
    )
    child = compose(system, code)
    child.wait_until_ready()
    page = Page(compose.domain_id, 'system', '--allow-changes')
    find, text_of = partial(find_all, browser), partial(read_text, browser)
    browser.get(page.address)
    wait_for(lambda: page.json('/api/state').get('health'), 'the system to answer')
    for parameter, value in (('texts', texts), ('long', long[:90_000])):
        wish = {'action': 'set', 'name': '/ear', 'parameter': parameter, 'text': json.dumps(value)}
        status, told = page.act(wish)
        assert status == 200, told

    def contents(selector):
        script = (
            'return [...document.querySelectorAll(arguments[0])].map((each) => each.textContent)'
        )
        return '\n'.join(browser.execute_script(script, selector))

    profile = QoSProfile(depth=200, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    log = peer.run(peer.node.create_publisher, Log, '/rosout', profile)
    names = peer.run(peer.node.create_publisher, JointState, '/names', 1)
    wait_for(lambda: log.get_subscription_count() and names.get_subscription_count(), 'a match')
    for text in [long, *texts]:
        log.publish(Log(level=30, name=text, msg=text))
    wait_for(lambda: shown[-1] in contents('#log li'), 'the log')
    assert [text for text in shown if contents('#log li').count(text) < 2] == []
    peer.run(peer.node.create_timer, 0.05, lambda: names.publish(JointState(name=[long, *texts])))
    wait_for(lambda: 'ValueError' in contents('#log li'), 'an error of a call')
    answer = wait_for(lambda: page.json('/api/message?topic=/names').get('text'), 'a message')
    assert len(answer) <= 100_001
    browser.get(f'http://127.0.0.1:{page.port}/#topic%3A%2Fnames')
    look_at_messages(browser, lambda: '<img src=x' in contents('#message pre'))
    find('#search')[0].send_keys('ear\n')
    wait_for(lambda: text_of('#details h2').startswith('/ear'), 'the page to be usable')
    values = 'return document.querySelector("#parameters input")?.value ?? ""'
    wait_for(lambda: SCRIPTS[0] in browser.execute_script(values), 'parameters')
    assert 'xxx…' in contents('#parameters dd')
    look_at_picture(peer, browser, page.port)
    assert len(json.dumps(page.json('/api/state'))) < 100_000
    assert browser.execute_script('return window.hit') is None
    assert not find('img, iframe, style, body script:not([src])')
    browser.get('about:blank')
    assert page.end() == 130
    assert child.stop() == 0


def test_the_keyboard_alone_reaches_all(acting, browser):
    from selenium.webdriver import ActionChains, Keys

    find, text_of = partial(find_all, browser), partial(read_text, browser)
    seen = """const focused = document.activeElement;
        const style = getComputedStyle(focused);
        const shape = focused.closest('svg') && getComputedStyle(focused.querySelector(':not(text):not(title)'));
        return [focused.matches(arguments[0]), focused === document.body
            || parseFloat(style.outlineWidth) > 0 && style.outlineStyle !== 'none'
            || shape?.stroke === 'rgb(251, 133, 0)' || shape?.stroke === 'rgb(255, 166, 87)']"""

    def press(*keys):
        ActionChains(browser).send_keys(*keys).perform()

    def go_to(selector, key=None):
        """Go there by Tab, and see at each step where the focus is."""
        for _ in range(120):
            press(Keys.TAB)
            is_there, is_seen = browser.execute_script(seen, selector)
            assert is_seen, browser.execute_script('return document.activeElement.outerHTML')
            if is_there:
                return press(key) if key else None
        return pytest.fail(f'Tab does not reach {selector}')

    def heading():
        return text_of('#details h2')

    browser.get(acting.address)
    wait_for(lambda: find('main svg .node') and find('#tree button'), 'the drawing')
    press('/', 'talker', Keys.ENTER)
    wait_for(lambda: heading().startswith('/left/talker'), 'what was searched')
    go_to('#matches button', Keys.ENTER)
    press(Keys.ESCAPE)
    go_to('#tree summary', Keys.ENTER)
    wait_for(lambda: find('#tree details:not([open])'), 'the closed namespace')
    press(Keys.ENTER)
    wait_for(lambda: not find('#tree details:not([open])'), 'the open namespace')
    go_to('#tree [data-id="node:/ear"] button', Keys.ENTER)
    wait_for(lambda: heading().startswith('/ear'), 'the node of the tree')
    go_to('#stage')
    box = find('main svg')[0].get_dom_attribute('viewBox')
    press(Keys.ARROW_LEFT)
    wait_for(lambda: find('main svg')[0].get_dom_attribute('viewBox') != box, 'a move')
    go_to('[aria-label="namespace /left"]', Keys.ENTER)
    wait_for(lambda: find('main svg .folded:focus'), 'the folded box')
    press(Keys.ENTER)
    wait_for(lambda: find('main svg .cluster:focus'), 'the open box')
    go_to('[aria-label="topic /left/words"]', Keys.ENTER)
    wait_for(lambda: heading().startswith('/left/words'), 'the topic')
    go_to('#message button', Keys.ENTER)
    # Where an answer takes long or none comes, the page pauses by itself.
    label = partial(text_of, '#message button:focus')

    def is_shown():
        return EVIL in text_of('#message pre') or (label() == 'Go on' and press(Keys.ENTER))

    wait_for(is_shown, 'a message')
    wait_for(lambda: label() == 'Go on' or press(Keys.ENTER), 'the pause')
    press('/', '/left/switch', Keys.ENTER)
    wait_for(lambda: find('#acts form button'), 'the service')
    go_to('#acts textarea')
    go_to('#acts button', Keys.ENTER)
    wait_for(lambda: EVIL in text_of('#acts form pre'), 'the response')


def test_boxes_fold_and_the_address_has_the_view(page, browser):
    from selenium.webdriver import ActionChains, Keys

    find, text_of = partial(find_all, browser), partial(read_text, browser)

    def names_of(style):
        script = (
            'return [...document.querySelectorAll(arguments[0])].map((each) => each.ariaLabel)'
            '.filter(Boolean)'
        )
        return set(browser.execute_script(script, f'main svg .{style}'))

    browser.get(page.address)
    # A box folds by a click and unfolds by the keyboard; what crosses its border is added up.
    browser.get(f'http://127.0.0.1:{page.port}/#&isolate=down')
    click(browser, 'main svg .cluster text')
    wait_for(lambda: find('main svg .folded.chosen'), 'the folded box')
    assert not find('[aria-label="node /left/talker"]')
    assert 'fold=box%3A%2Fleft' in browser.current_url
    wait_for(lambda: re.search(r'all 1\s+\d', text_of('#live')), 'the sum')
    browser.refresh()
    wait_for(lambda: find('main svg .folded.chosen'), 'the view of the address')
    shown = {'namespace /left', 'topic /left/words', 'node /ear'}
    wait_for(lambda: names_of('near') == shown, 'what is downstream')
    browser.execute_script('document.querySelector(".folded").focus()')
    ActionChains(browser).send_keys(Keys.ENTER).perform()
    wait_for(lambda: find('main svg .cluster.chosen[aria-expanded=true]'), 'the open box')
    label = 'return document.activeElement.ariaLabel'
    wait_for(lambda: browser.execute_script(label) == 'namespace /left', 'the focus')
    # A click isolates what is downstream, or upstream.
    click(browser, '[aria-label="topic /left/words"] text')
    wait_for(lambda: names_of('near') == {'topic /left/words', 'node /ear'}, 'what is downstream')
    upstream = {'topic /left/words', 'node /left/talker', 'service /left/switch'}
    click(browser, '#isolation option[value=up]')
    wait_for(lambda: names_of('near') == upstream, 'what is upstream')
    assert browser.current_url.endswith('#topic%3A%2Fleft%2Fwords&isolate=up')
    # What is clicked while a drawing comes stays selected.
    browser.execute_script(
        """const real = window.fetch;
        window.fetch = (path, ...more) => (String(path).startsWith('api/drawing')
            ? new Promise((come) => { window.comes = () => come(real(path, ...more)); })
            : real(path, ...more));"""
    )
    click(browser, '#fold-all')
    wait_for(lambda: browser.execute_script('return Boolean(window.comes)'), 'the question')
    click(browser, '[aria-label="node /ear"] text')
    wait_for(lambda: '#node%3A%2Fear' in browser.current_url, 'the selection')
    browser.execute_script('window.comes()')
    wait_for(lambda: find('main svg .folded'), 'the folded box')
    assert '#node%3A%2Fear' in browser.current_url


def test_of_many_nodes_those_of_inner_namespaces_are_folded_at_first(browser, tmp_path):
    text = 'version: 1\nnodes:\n'
    for index in range(110):
        space = '/a/low' if index % 11 else '/b'
        text += f'  n_{index}: {{namespace: {space}}}\n'
    (tmp_path / 'many.yaml').write_text(text)
    many = Page(0, str(tmp_path / 'many.yaml'))
    assert len(many.json('/api/drawing')['stands_in']) == 100
    assert not many.json('/api/drawing?folded=')['stands_in']
    browser.get(many.address)
    label = '[aria-label="namespace /a/low"]'
    wait_for(lambda: find_all(browser, f'{label}[aria-expanded=false]'), 'the folded box')
    assert find_all(browser, '[aria-label="namespace /b"][aria-expanded=true]')
    click(browser, f'{label} text')
    wait_for(lambda: find_all(browser, f'{label}[aria-expanded=true]'), 'the open box')
    assert len(find_all(browser, 'main svg .node')) == 110
    browser.get('about:blank')
    assert many.end() == 130


def test_a_browser_shows_it(page, acting, shared_compose, browser):
    from selenium.webdriver import Keys

    find, text_of = partial(find_all, browser), partial(read_text, browser)
    # The page of an earlier test asks a server that has ended.
    browser.get('about:blank')
    browser.get_log('browser')
    browser.get(page.address)
    wait_for(lambda: 'subscription words of /ear' in text_of('#problems'), 'the problem')
    wait_for(lambda: find('main svg .node.hurts, main svg .node.warns'), 'the node that hurts')
    # A click on the problem leads to its node, and the keyboard to another one.
    click(browser, '#problems button', 'subscription words of /ear')
    wait_for(lambda: text_of('#details h2').startswith('/ear'), 'the selection')
    assert browser.current_url.endswith('#node%3A%2Fear')
    wait_for(lambda: 'subscription words' in text_of('#live'), 'figures')
    wait_for(lambda: EVIL in text_of('#log'), 'the log')
    browser.switch_to.active_element.send_keys('/talker\n')
    wait_for(lambda: text_of('#details h2').startswith('/left/talker'), 'what was searched')
    wait_for(lambda: EVIL in text_of('#parameters'), 'parameters')
    assert 'parts:say' in text_of('#details pre')
    browser.get(f'http://127.0.0.1:{page.port}/#topic%3A%2Fleft%2Fwords')
    wait_for(lambda: find('#message button'), 'the topic')
    look_at_messages(browser, lambda: EVIL in text_of('#message pre'))
    # Where it may, it changes values, and does what a saved edit would.
    browser.get(acting.address)
    wait_for(lambda: find('#tree button'), 'the nodes')
    browser.get(f'http://127.0.0.1:{acting.port}/#node%3A%2Fleft%2Ftalker')
    act_on(browser, '#parameters input', lambda field: field.clear() or field.send_keys('3.5\n'))
    wait_for(lambda: text_of('#parameters form pre') == 'gain = 3.5', 'the answer')
    assert 'def say(node)' in text_of('#details')
    assert find('#details a')[0].get_attribute('href').startswith('vscode://file/')
    browser.get(f'http://127.0.0.1:{acting.port}/#service%3A%2Fleft%2Fswitch')
    click(browser, '#acts form button')
    wait_for(lambda: EVIL in text_of('#acts form pre'), 'the response')
    browser.get(f'http://127.0.0.1:{acting.port}/#node%3A%2Fleft%2Ftalker')
    act_on(browser, '#parameters input', lambda field: field.send_keys('4'))
    typed = find('#parameters input')[0]
    drawn = find('main svg')
    text = (shared_compose.folder / 'system.yaml').read_text()
    (shared_compose.folder / 'system.yaml').write_text(re.sub(r'rate: \d+', 'rate: 8', text))
    wait_for(lambda: 'period' in text_of('#plan'), 'the plan')
    click(browser, '#reload')
    wait_for(lambda: '~1 timer' in text_of('#last'), 'the reload')
    wait_for(lambda: find('main svg') not in (drawn, []), 'the new drawing')
    assert typed.get_property('value').endswith('4')
    # All can use it, in light and dark; what is not chosen is dim in the drawing.
    for rest in ([['main svg']], []):
        for scheme in ('light', 'dark'):
            media = {'features': [{'name': 'prefers-color-scheme', 'value': scheme}]}
            browser.execute_cdp_cmd('Emulation.setEmulatedMedia', media)
            assert find_violations(browser, rest) == []
        browser.find_element('css selector', 'body').send_keys(Keys.ESCAPE)
    assert not find('img')
    # It has its declared parameters again, for the other tests.
    assert acting.act({'action': 'restart', 'name': '/left/talker'})[0] == 200
    assert [each for each in browser.get_log('browser') if each['level'] == 'SEVERE'] == []


def test_a_browser_stops_and_starts_a_node_and_records(acting, browser):
    """By keyboard: the focus is kept where one button takes the place of another."""
    from selenium.webdriver import ActionChains, Keys

    text_of = partial(read_text, browser)
    browser.get(acting.address)
    # As if a drawing came before the page gets to know its new address.
    browser.execute_script(
        'const newURL = `${location.href}#node%3A%2Fleft%2Ftalker`;'
        'dispatchEvent(new HashChangeEvent("hashchange", {newURL}))'
    )
    for verb, then in (('Stop', 'Start'), ('Start', 'Restart')):
        script = (
            "const found = [...document.querySelectorAll('#acts button')]"
            '.find((each) => each.innerText.startsWith(arguments[0])); found?.focus(); return found'
        )
        wait_for(lambda: browser.execute_script(script, verb), verb)  # noqa: B023
        ActionChains(browser).send_keys(Keys.ENTER).perform()
        focus = 'return document.activeElement.innerText'
        wait_for(lambda: browser.execute_script(focus) == f'{then} the node', then)  # noqa: B023
        stopped = 'talker was stopped' in text_of('#problems')
        assert stopped is (verb == 'Stop')
        assert ('talker (stopped)' in text_of('#tree')) is stopped
    click(browser, '#record')
    wait_for(lambda: text_of('#record') == 'End the recording', 'the recording')
    click(browser, '#record')
    wait_for(lambda: 'recorded' in text_of('#recorded'), 'its end')
