"""Faults of cases: messages lost, late or doubled, nodes and workers that end and come again."""

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run as composer

pytestmark = pytest.mark.ros

FILES = {
    'robot.yaml': """
version: 1
workers:
  drivers: {restart: {when: always, delay: 0.5}}
  vital: {restart: {when: never}, required: true}
nodes:
  talker:
    worker: drivers
    parameters: {word: hello}
    publishers: {said: std_msgs/msg/String}
    timers: {tick: {rate: 10, behaviour: "parts:tick", publish: said}}
    services: {ask: {type: std_srvs/srv/Trigger, behaviour: "parts:answer"}}
    on_stop: parts:leave
  made:
    timers: {tick: {rate: 10, behaviour: "parts:make"}}
  hearer:
    subscriptions:
      said: {type: std_msgs/msg/String, behaviour: "parts:hear"}
      made: {type: std_msgs/msg/String, external: true, behaviour: "parts:hear"}
  heart: {worker: vital}
""",
    'parts.py': """
from std_msgs.msg import String


def tick(node):
    node.state.count = getattr(node.state, 'count', -1) + 1
    return f'{node.parameters.word} {node.state.count}'


def make(node):
    if not hasattr(node.state, 'publisher'):
        node.state.publisher = node.ros.create_publisher(String, 'made', 10)
    node.state.publisher.publish(String(data='made'))


def answer(node, request):
    node.sleep(0.5)
    return {'success': True}


def leave(node):
    node.logger.info('bye')


def hear(node, message):
    node.logger.info(f'{node.now().nanoseconds % 10**9 // 10**6} {message.data}')
""",
    'faults.scenario.yaml': """
version: 1
system: {file: robot.yaml}
until: 2.0
cases:
  lost:
    when: [{at: 0.45, drop: /said, for: 0.3}, {at: 0.95, drop: made}]
    then:
      - {topic: /said, count: 20}
      - {log: hearer, text: hello, count: 17}
      - {log: hearer, matches: "^[567]00 hello [4-6]", never: true}
      - {log: hearer, text: made, count: 9}
  late and doubled:
    when:
      - {at: 0.15, delay: said, by: 0.25, for: 0.1}
      - {at: 0.15, duplicate: said, for: 0.1}
      - {at: 0.35, duplicate: said, for: 0.1}
      - {at: 0.15, delay: made, by: 5}
    then:
      - {log: hearer, text: "450 hello 1", count: 2}
      - {log: hearer, text: "400 hello 3", count: 2}
      - {log: hearer, text: hello, count: 22}
      - {log: hearer, text: made, count: 1}
  what a step publishes:
    when: [{at: 0.5, drop: /made, for: 0}, {at: 0.9, drop: /made, for: 0.2}, {at: 1.0, publish: /made, message: {data: step}}]
    then: [{log: hearer, text: step, never: true}, {log: hearer, text: made, count: 18}]
  stopped:
    when: [{at: 0.55, stop: talker}, {at: 1.05, start: /talker}]
    then:
      - {log: talker, text: bye, count: 1, within: [0.5, 0.6]}
      - {topic: /said, count: 14}
      - {topic: /said, count: 0, within: [0.56, 1.1]}
      - {topic: /said, where: data == 'hello 0', count: 2}
  killed:
    when:
      - {at: 0.55, kill: talker}
      - {at: 0.6, call: /ask, fails: true, timeout: 0.5}
    then:
      - {log: talker, text: bye, never: true}
      - {topic: /said, count: 5}
  a worker is started again:
    when: [{at: 0.55, kill: drivers}]
    then:
      - {log: talker, text: bye, count: 0, within: [0, 1.9]}
      - {topic: /said, count: 0, within: [0.56, 1.14]}
      - {topic: /said, count: 14}
  restarted:
    when: [{at: 0.55, restart: drivers}]
    then: [{topic: /said, where: data == 'hello 0', count: 2}]
  a vital worker:
    when: [{at: 0.55, kill: vital}]
    then: [{exit_code: 1, within: [0.5, 0.6]}]
""",
    'wrong.scenario.yaml': """
version: 1
system: {file: robot.yaml}
until: 2.0
cases:
  twice:
    when: [{at: 0.5, kill: talker}, {at: 0.6, stop: talker}]
    then: [{topic: /said}]
  runs:
    when: [{at: 0.5, start: talker}]
    then: [{topic: /said}]
""",
}


@pytest.fixture
def project(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_faults_do_what_they_say(project, monkeypatch, capfd):
    monkeypatch.chdir(project)
    code = composer(['test', 'faults.scenario.yaml'])
    output = capfd.readouterr().out
    assert code == 0, output
    assert '8 passed' in output
    assert composer(['test', 'wrong.scenario.yaml']) == 1
    output = capfd.readouterr().out
    assert "node '/talker' does not run" in output
    assert "node '/talker' runs" in output
    assert 'wrong.scenario.yaml:7' in output


@pytest.mark.parametrize(
    ('step', 'expected'),
    [
        ('kill: takler', "there is no node 'takler' in this system"),
        ('stop: drivres', "did you mean 'drivers'?"),
        ('drop: /siad', "the system has no topic '/siad'"),
        ('delay: /said', "'delay' requires 'by'"),
        ('kill: talker, for: 1', "'kill' and 'for' cannot be used together"),
        ('drop: /said, type: std_msgs/msg/String', "'drop' and 'type' cannot be used together"),
    ],
)
def test_what_is_not_there_is_a_finding(project, step, expected, monkeypatch, capsys):
    monkeypatch.chdir(project)
    case = f'{{when: [{{at: 0.5, {step}}}], then: [{{topic: /said}}]}}'
    (project / 'bad.scenario.yaml').write_text(
        f'version: 1\nsystem: {{file: robot.yaml}}\nuntil: 1\ncases:\n  a: {case}\n'
    )
    assert composer(['check', 'bad.scenario.yaml']) == 1
    assert expected in capsys.readouterr().out
