"""What stands for devices in a case: values and recordings of sources, objects of the project."""

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run as composer
from tests.recorded import write_recording

pytestmark = pytest.mark.ros

FILES = {
    'pyproject.toml': '',
    'robot.yaml': """
        version: 1
        nodes:
          gps:
            publishers: {fix: std_msgs/msg/String}
            sources:
              port: {behaviour: "drivers.gps:read", publish: fix}
              silent: {behaviour: "drivers.gps:wait"}
          nav:
            subscriptions: {fix: {type: std_msgs/msg/String, behaviour: "nav:hear"}}
    """,
    'nav.py': """
        import time

        def hear(node, message):
            first, second = node.now(), node.now()
            passed = (second - first).nanoseconds, time.perf_counter_ns() < time.perf_counter_ns()
            node.logger.info(f'{message.data} at {first.nanoseconds % 10**9} {passed}')
    """,
    'drivers/__init__.py': 'from drivers import gps',
    'drivers/port.py': """
        class Port:
            speed = 9600
            def __init__(self, name):
                raise OSError(f'no port {name}')
    """,
    # Bound before anything is replaced, as the package imports it.
    'drivers/gps.py': """
        from drivers.port import Port

        def read(node):
            port = Port('/dev/gps')
            while True:
                yield port.read()

        def wait(node):
            raise RuntimeError('no device')
    """,
    'tests/__init__.py': '',
    'tests/fakes.py': """
        import time
        from drivers.port import Port as Real

        class Port:
            def __init__(self, name):
                self.name, self.count = name, 0

            def read(self):
                time.sleep(0.25)
                self.count += 1
                return f'{self.name} {self.count}'

        def idle(node):
            node.sleep(100)
    """,
    'tests/gps.scenario.yaml': """
        version: 1
        system: {file: ../robot.yaml}
        until: 1.0
        cases:
          values:
            given:
              sources:
                port:
                  - {at: 0.5, value: once}
                  - {at: 0.6, every: 0.1, times: 2, value: {data: again}}
                  - {at: 3.0, value: never}
            then:
              - {topic: /fix, count: 3}
              - {log: nav, text: 'once at 500000000 (1, True)'}
              - {log: nav, text: 'again at 700000000 (1, True)'}
          recording:
            given: {sources: {gps/port: gps.mcap}}
            then:
              - {topic: /fix, count: 2}
              - {log: nav, text: 'two at '}
          objects:
            given: {replace: {'drivers.port:Port': 'tests.fakes:Port', 'drivers.gps:wait': 'tests.fakes:idle'}}
            then:
              - {topic: /fix, count: 4, within: [0, 1.0]}
              - {log: nav, text: '/dev/gps 4 at 0 (1, True)'}
          neither:
            then: [{topic: /fix, count: 0}]
    """,
}


@pytest.fixture
def project(tmp_path):
    from textwrap import dedent

    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(dedent(text))
    return tmp_path


def test_cases_stand_for_devices(project, monkeypatch, capfd):
    from std_msgs.msg import String

    recorded = {'/fix': [String(data='one'), String(data='two')], '/other': [String()]}
    write_recording(project / 'tests' / 'gps.mcap', recorded)
    monkeypatch.chdir(project)
    code = composer(['test', 'tests'])
    output = capfd.readouterr().out
    assert code == 0, output
    assert '4 passed' in output


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ('sources: {prt: []}', "no source 'prt'"),
        ('sources: {silent: []}', "has no 'publish': its values go nowhere"),
        ('sources: {port: [{value: {dta: 1}}]}', "std_msgs/msg/String has no field 'dta'"),
        ('sources: {port: no.mcap}', "there is no file '"),
        ('replace: {"drivers.port:Prt": "tests.fakes:Port"}', "'Prt' is not in the module"),
        ('replace: {"drivers.port:Port.sped": "nav:hear"}', "there is no 'Port.sped' in"),
        ('replace: {"drivers.prt:Port": "nav:hear"}', "there is no module 'drivers.prt'"),
    ],
)
def test_what_is_not_there_is_a_finding(project, given, expected, monkeypatch, capsys):
    monkeypatch.chdir(project)
    path = project / 'tests' / 'bad.scenario.yaml'
    case = f'{{given: {{{given}}}, then: [{{topic: /fix, count: 0}}]}}'
    path.write_text(
        f'version: 1\nsystem: {{file: ../robot.yaml}}\nuntil: 1\ncases:\n  a: {case}\n'
    )
    assert composer(['check', 'tests/bad.scenario.yaml']) == 1
    assert expected in capsys.readouterr().out
