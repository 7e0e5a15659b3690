"""A run of `composer test`: which cases, in which orders, what is written and how it ends."""

import os
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from composer.cli.main import run

pytestmark = pytest.mark.ros

PASSING = """
    counts: {then: [{topic: /out, count: 6}]}
    counts up: {then: [{topic: /out, eventually: data == 6}]}
"""
FAILING = """
    miscounts: {then: [{topic: /out, count: 1}]}
    counts: {then: [{topic: /out, count: 6}]}
"""
# Each second, both change what the other one sees.
RACE = """
    version: 1
    nodes:
      first:
        publishers: {out: std_msgs/msg/Int64}
        timers: {tick: {period: 1, behaviour: 'race:give', publish: out}}
      second:
        timers: {tick: {period: 1, behaviour: 'race:take'}}
"""
RACE_CODE = """
    taken = []

    def give(node):
        return len(taken)

    def take(node):
        taken.append(1)
"""


def test_the_default_is_what_lies_under_tests(project, capsys):
    project.scenario(PASSING)
    project.scenario(FAILING, name='other/tests/worker')
    assert run(['test']) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(' [')[0] for line in lines[:2]] == [
        'tests/worker.scenario.yaml::counts PASSED',
        'tests/worker.scenario.yaml::counts up PASSED',
    ]
    assert '2 passed in' in lines[2]


@pytest.mark.parametrize(
    ('words', 'outcomes'),
    [
        (['-k', 'not miscounts'], {'counts': 'passed'}),
        (['-x'], {'miscounts': 'failed'}),
    ],
)
def test_options_choose_cases(project, run_json, words, outcomes):
    project.scenario(FAILING)
    code, report = run_json(*words)
    assert {case['case']: case['outcome'] for case in report['cases']} == outcomes
    assert code == ('failed' in outcomes.values())


def test_without_cases_it_ends_as_pytest_does(project, capsys):
    assert run(['test']) == 5
    assert capsys.readouterr().err == 'no file matches tests/**/*.scenario.yaml\n'
    project.scenario(PASSING)
    assert run(['test', '-k', 'nothing']) == 5
    assert capsys.readouterr().err == 'no case has such a name\n'


def test_a_file_with_errors_is_one_error_and_the_others_run(project, run_json):
    project.scenario(PASSING.replace('/out', '/outt'), name='tests/a')
    project.scenario(PASSING, name='tests/b')
    code, report = run_json()
    assert (code, report['errors'], report['passed']) == (1, 1, 2)
    assert report['cases'][0]['file'] == 'tests/a.scenario.yaml'
    assert any("did you mean '/out'?" in str(each['help']) for each in report['findings'])


def test_the_trace_is_the_same_each_time_whatever_the_machine_says(project, monkeypatch):
    project.scenario(PASSING)
    assert run(['test', '--trace', 'one', '--seed', '4']) == 0
    monkeypatch.setenv('PYTHONHASHSEED', '77')
    monkeypatch.setenv('TZ', 'Asia/Tokyo')
    assert run(['test', '--trace', 'two', '--seed', '4', '--jobs', '2']) == 0
    one, two = (Path(name).read_bytes() for name in ('one', 'two'))
    assert one == two
    lines = one.decode().splitlines()
    assert lines[0] == '# tests/worker.scenario.yaml::counts seed 4'
    assert '0.500000000 message /worker /out {data: 1}' in lines


def test_a_junit_report_of_cases_that_run_at_once_is_written(project, run_json):
    project.scenario(FAILING)
    code, report = run_json('--jobs', '2', '--junit', 'report.xml')
    outcomes = {case['case']: case['outcome'] for case in report['cases']}
    assert (code, outcomes) == (1, {'miscounts': 'failed', 'counts': 'passed'})
    (suite,) = ET.parse('report.xml').getroot()
    assert [(case.get('name'), case.find('failure') is None) for case in suite] == [
        ('miscounts', False),
        ('counts', True),
    ]


@pytest.fixture
def race(project):
    project.write('system.yaml', RACE)
    project.write('race.py', RACE_CODE)
    # In the default order, `first` is first each time: 0, 1, 2.
    project.scenario('sees: {then: [{topic: /out, never: "data == 3"}]}')
    return project


def test_a_shuffle_finds_the_order_that_fails_and_it_can_be_had_again(race, run_json):
    assert run_json()[0] == 0
    code, report = run_json('--shuffle', '4')
    assert code == 1
    (case,) = report['cases']
    assert case['failures'] == []
    failing = [each for each in case['shuffled'] if each['failures']]
    assert [each['seed'] for each in case['shuffled']] == [0, 1, 2, 3]
    difference = failing[0]['difference']
    assert difference[0] == 'the default order:'
    assert f'the order of seed {failing[0]["seed"]}:' in difference
    assert case['run_again'] == (
        f'composer test tests/worker.scenario.yaml::sees --seed {failing[0]["seed"]} --shuffle 1'
    )
    code, again = run_json(*case['run_again'].split()[2:])
    assert code == 1
    assert again['cases'][0]['shuffled'][0]['difference'] == difference


def processes_of(pid):
    """Return the processes of the session that a process leads."""
    found = []
    for path in Path('/proc').glob('[0-9]*/stat'):
        try:
            fields = path.read_text().rpartition(')')[2].split()
        except OSError:
            continue
        if fields[0] != 'Z' and int(fields[3]) == pid:
            found.append(path.parent.name)
    return found


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGKILL])
def test_a_signal_ends_all_and_leaves_nothing_behind(project, wait_for, number, tmp_path):
    project.scenario(
        'blocks: {given: {parameters: {worker: {mode: blocks}}}, then: [{exit_code: 0}]}'
    )
    temporary = tmp_path / 'temporary'
    temporary.mkdir()
    process = subprocess.Popen(
        [sys.executable, '-m', 'composer', 'test', '-s', '--jobs', '2'],
        env=os.environ | {'TMPDIR': str(temporary)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        text=True,
    )
    try:
        wait_for(lambda: len(processes_of(process.pid)) > 2, 'the process of the case')
        process.send_signal(number)
        said = process.communicate(timeout=30)[0]
        assert process.returncode == (130 if number == signal.SIGINT else -number)
        assert ('interrupted' in said) == (number != signal.SIGKILL)
        wait_for(lambda: not processes_of(process.pid), 'the end of all processes')
        left = [each for each in temporary.iterdir() if 'traces' not in each.name]
        assert not (left if number == signal.SIGKILL else list(temporary.iterdir()))
    finally:
        process.kill()


LIBRARY = """
    from std_msgs.msg import String

    def begin(node):
        publisher = node.ros.create_publisher(String, 'status', 10)
        node.state.timer = node.ros.create_timer(
            1.0, lambda: publisher.publish(String(data='well'))
        )
"""


def test_what_a_library_publishes_can_be_expected_by_its_type(project, run_json):
    project.write('library.py', LIBRARY)
    system = 'version: 1\nnodes: {n: {on_start: "library:begin"}}\nprocesses: {v: {package: none, executable: none}}\n'
    project.write('library.yaml', system)
    given = 'topic: /status, type: std_msgs/msg/String, message'
    cases = f'well: {{then: [{{{given}: well}}], until: 3}}\n  ill: {{then: [{{{given}: ill}}], until: 3}}'
    text = f'version: 1\nsystem: {{file: library.yaml}}\ncases:\n  {cases}\n'
    project.write('library.scenario.yaml', text)
    _, report = run_json('library.scenario.yaml')
    assert [case['outcome'] for case in report['cases']] == ['passed', 'failed']
