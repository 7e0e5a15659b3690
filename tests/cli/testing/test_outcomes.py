"""What comes of cases: passed, failed as an expectation says, or ended by a behaviour."""

import pytest

from tests.cli.testing.conftest import Project

pytestmark = pytest.mark.ros

MODES = ('works', 'fails', 'crashes', 'exits', 'loops', 'blocks', 'reads_real_time')
THEN = '{topic: /out, count: 6}'


@pytest.fixture(scope='module')
def reports(tmp_path_factory):
    """Run one case for each mode, and return their reports by the modes."""
    import json
    import subprocess
    import sys

    folder = tmp_path_factory.mktemp('modes')
    project = Project(folder)
    cases = [
        f'  {mode}: {{given: {{parameters: {{worker: {{mode: {mode}}}}}}}, then: [{THEN}]}}'
        for mode in MODES
    ]
    project.scenario('\n'.join([*cases, '  wrong: {then: [{topic: /out, count: 7}]}\n']))
    words = ['test', '--format', 'json', '--jobs', '4', '--real-time-limit', '4']
    done = subprocess.run(
        [sys.executable, '-m', 'composer', *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    return {case['case']: case for case in json.loads(done.stdout)['cases']}


def failure_of(report):
    assert report['outcome'] == 'failed'
    return report['failures'][0]


def test_a_case_that_works_passes_with_what_it_printed(reports):
    report = reports['works']
    assert (report['outcome'], report['failures']) == ('passed', [])
    assert (report['simulated_sec'], report['stdout']) == (3.0, 'this was printed\n')
    assert '0.5 s [info] [/hearer]: heard 1' in report['log']
    # The log is told with virtual times; nothing of it is printed beside.
    assert report['stderr'] == ''


def test_an_expectation_that_does_not_hold_is_shown_with_its_place(reports):
    failure = failure_of(reports['wrong'])
    assert failure['kind'] == 'expectation'
    assert (failure['file'], failure['line']) == ('tests/worker.scenario.yaml', 12)
    assert 'expected 7 messages on /out' in failure['message']
    assert any('/out {data: 6}' in line for line in failure['around'])


def test_a_behaviour_that_raises_fails_the_case(reports):
    messages = [failure['message'] for failure in reports['fails']['failures']]
    assert any('ValueError: planned' in message for message in messages)
    assert any('in fails' in ''.join(each['difference']) for each in reports['fails']['failures'])


@pytest.mark.parametrize(
    ('mode', 'kind', 'message'),
    [
        ('crashes', 'died', 'its process was ended by SIGSEGV'),
        ('exits', 'died', 'its process ended with exit code 7'),
        ('loops', 'stuck', ''),
        ('blocks', 'stuck', 'it took longer than 4 s of real time'),
    ],
)
def test_what_ends_or_holds_the_process_is_a_failure(reports, mode, kind, message):
    failure = failure_of(reports[mode])
    assert failure['kind'] == kind
    assert message in failure['message']
    if mode != 'exits':
        assert f'in {mode}' in failure['stack']


def test_what_is_not_repeatable_is_named_with_its_line(reports):
    (notice,) = reports['reads_real_time']['not_repeatable']
    assert 'parts.py:' in notice
    assert 'process_time' in notice


def test_it_tells_the_command_that_runs_it_again(reports):
    assert reports['wrong']['run_again'] == (
        'composer test tests/worker.scenario.yaml::wrong --seed 0 --real-time-limit 4'
    )
