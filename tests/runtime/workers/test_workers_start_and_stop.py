"""Nodes in workers start and stop with their system, as nodes of its own process do."""

import os

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run
from tests.running import descendants
from tests.runtime.workers.observed import (
    CODE,
    HEARS,
    TALKS,
    node,
    pid_of,
    system,
    wait_until_gone,
)

pytestmark = pytest.mark.ros


def test_each_worker_is_a_process_with_its_settings_and_what_crosses_arrives(compose):
    tell = """
    def tell(node):
        print('has', os.environ['SENSOR'], os.sched_getaffinity(0), os.nice(0), flush=True)
    """
    child = compose(
        system(
            {
                'talker': node('left', *TALKS),
                'near': node('left', 'timers: {t: {period: 0.2, behaviour: parts:tell}}', *HEARS),
                'far': node('right', *HEARS),
                'home': node('', *HEARS),
            },
            'workers: {left: {environment: {SENSOR: front}, cpus: [1], nice: 3, threads: 2}}\n',
        ),
        CODE + tell,
    )
    child.wait_until_ready()
    pids = {name: pid_of(child, name) for name in ('talker', 'near', 'far', 'home')}
    assert pids['talker'] == pids['near']
    assert len({*pids.values()}) == 3
    assert pids['home'] == child.pid
    for name in ('near', 'far', 'home'):
        line = child.wait_for_line(f'{name} hears')
        assert line.endswith(f'of {pids["talker"]} in {pids[name]}')
    assert child.wait_for_line('has') == f'has front {{1}} {os.nice(0) + 3}'
    assert child.stop() == 0
    ends = [line for line in child.lines if ' ends in ' in line]
    assert sorted(ends) == sorted(f'{name} ends in {pid}' for name, pid in pids.items())
    wait_until_gone(pids.values())


def test_no_on_start_runs_before_all_nodes_of_all_workers_exist(compose):
    child = compose(
        system(
            {
                'talker': node('left', *TALKS),
                'late': node('right', *HEARS),
            },
            'workers: {right: {cpus: [0, 1023]}}\n',
        ),
        CODE,
    )
    assert child.wait() == 1
    assert 'begins' not in child.output
    assert child.matching("error: worker 'right' cannot have cpus [0, 1023]")
    assert child.matching('help: the cores that there are for it: [0')


def test_an_on_start_in_a_worker_that_raises_ends_the_start(compose):
    child = compose(
        system(
            {
                'home': node('', *TALKS),
                'good': node('left', *HEARS),
                'bad': '{worker: right, on_start: {behaviour: parts:fail_when_told}}',
            }
        ),
        CODE,
    )
    # Only what has begun ends.
    child.wait_for_line('home begins')
    good = pid_of(child, 'good')
    (compose.folder / 'fail').touch()
    assert child.wait() == 1
    assert child.lines[-1] == "error: node 'bad': on_start raised ValueError('no camera')"
    assert not child.matching(' ready in ')
    assert child.matching('good ends in')
    assert child.matching('home ends in')
    wait_until_gone([good])


def test_what_waits_is_started_across_workers(compose):
    serves = node(
        'left', 'services: {add: {type: std_srvs/srv/Empty, service: add, behaviour: parts:serve}}'
    )
    waiting = node('right', 'wait_for: {service: add}', *HEARS)
    last = node('', 'wait_for: {node: second}', *TALKS)
    patient = node('right', 'wait_for: {process: setup}')
    child = compose(
        system(
            {'third': last, 'second': waiting, 'first': serves, 'patient': patient},
            'processes: {setup: {command: [sh, -c, "sleep 0.5"]}}\n',
        ),
        CODE,
    )
    child.wait_until_ready()
    begun = [line.split()[0] for line in child.lines if ' begins in ' in line]
    assert [each for each in begun if each != 'patient'] == ['first', 'second', 'third']
    assert begun.index('first') < begun.index('patient')
    child.wait_for_line('second hears')
    assert child.stop() == 0


def test_a_node_of_a_worker_ends_the_system_with_its_exit_code(compose):
    timer = 'timers: {t: {period: 0.1, behaviour: parts:end_system}}'
    child = compose(system({'home': node('', *HEARS), 'last': node('right', timer)}), CODE)
    assert child.wait() == 3
    assert child.matching('home ends in')
    assert child.matching('last ends in')


@pytest.mark.parametrize(
    ('name', 'code', 'log_folder', 'problem'),
    [
        ('begin', 'raise ValueError', '', 'a.yaml:3:'),
        ('begin', '', '/proc/new', 'ROS cannot keep its log files'),
    ],
    ids=['the import', 'the environment'],
)
def test_what_was_started_for_a_system_that_cannot_start_ends(
    tmp_path, monkeypatch, capsys, name, code, log_folder, problem
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('ROS_LOG_DIR', log_folder)
    (tmp_path / 'parts.py').write_text(f'def begin(node): pass\n{code}\n')
    (tmp_path / 'a.yaml').write_text(system({'a': f'{{worker: left, on_start: parts:{name}}}'}))
    before = descendants(os.getpid())
    assert run(['up', 'a.yaml']) == 1
    assert problem in ''.join(capsys.readouterr())
    wait_until_gone({*descendants(os.getpid())} - {*before})
