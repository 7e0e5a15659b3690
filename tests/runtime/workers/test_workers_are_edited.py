"""An edit moves nodes between workers, and brings, changes and ends workers."""

import json
import os

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run
from tests.running import is_there
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


def edit(compose, child, text, code=CODE, *, fails=False):
    """Write new files, and wait until the system has taken them, or refused to."""
    sign = 'not reloaded: ' if fails else ': reloaded in'
    done = len(child.matching(sign))
    compose.write(text, code)
    child.wait_for_line(sign, times=1 + done)


def test_nodes_move_between_workers_and_the_rest_stays(compose):
    def text(talker, far, more=''):
        nodes = {
            'talker': node(talker, *TALKS),
            'far': node(far, *HEARS),
            'home': node('', *HEARS),
        }
        return system(nodes, more)

    child = compose(text('left', 'right'), CODE, '--watch')
    child.wait_until_ready()
    left, right = pid_of(child, 'talker'), pid_of(child, 'far')

    # They exchange their places: two nodes of a name would disturb each other.
    edit(compose, child, text('right', 'left'))
    assert pid_of(child, 'talker', times=2) == right
    assert pid_of(child, 'far', times=2) == left
    child.wait_for_line(f'far hears 1 of {right} in {left}')

    # A worker that loses its last node goes; one that is named comes.
    edit(compose, child, text('', 'new'))
    assert pid_of(child, 'talker', times=3) == child.pid
    new = pid_of(child, 'far', times=3)
    wait_until_gone([left, right])

    # What a process takes only when it starts needs another one.
    limits = 'workers: {new: {environment: {SENSOR: front}, restart: {when: never}}}\n'
    edit(compose, child, text('', 'new', limits))
    newest = pid_of(child, 'far', times=4)
    assert newest != new
    wait_until_gone([new])
    edit(
        compose,
        child,
        text('', 'new', limits.replace('}, restart', '}, cpus: [1], threads: 2, restart')),
    )
    assert os.sched_getaffinity(newest) == {1}
    assert len(child.matching('home begins')) == 1
    assert child.stop() == 0


def test_who_calls_a_server_moves_with_it(compose):
    # Longer than a node may take to end: who waits for what has ended already hangs.
    code = (
        CODE
        + """
    def call(node):
        node.call('empty', timeout=100)
        print(f'{node.name} is answered', flush=True)
    """
    )
    serves = 'services: {empty: {type: std_srvs/srv/Empty, behaviour: parts:serve}}'
    calls = (
        'service_clients: {empty: std_srvs/srv/Empty}',
        'timers: {call: {period: 0.01, behaviour: parts:call}}',
    )

    def text(server, client, more=''):
        nodes = {'server': node(server, serves), 'client': node(client, *calls)}
        return system(nodes, f'executor: {{shutdown_timeout: 8}}\n{more}')

    child = compose(text('left', 'right'), code, '--watch')
    environment = 'workers: {both: {environment: {SENSOR: front}}}\n'
    for times in (1, 2):
        if times == 2:
            edit(compose, child, text('both', 'both', environment), code)
        pid_of(child, 'client', times=times)
        done = len(child.matching('is answered'))
        child.wait_for_line('is answered', times=done + 2)
    assert child.stop() == 0


def tell_of_workers(capsys, pids):
    """Check what the commands say of the workers of a talker and of one who hears it."""
    assert run(['ps', '--format', 'json']) == 0
    (found,) = json.loads(capsys.readouterr()[0])['systems']
    assert found['nodes'] == ['/talker', '/far']
    assert found['workers'] == [
        {'name': name, 'state': 'running', 'pid': pid, 'restarts': 0, 'nodes': [node_name]}
        for name, pid, node_name in zip(('left', 'right'), pids, ('/talker', '/far'), strict=True)
    ]
    assert run(['top', '--once', '--format', 'json']) == 0
    entities = json.loads(capsys.readouterr()[0])['entities']
    assert {(each['node'], each['worker']) for each in entities} == {
        ('/talker', 'left'),
        ('/far', 'right'),
    }


def test_new_code_runs_in_workers_and_a_bad_edit_changes_nothing(compose, capsys, monkeypatch):
    nodes = {'talker': node('left', *TALKS), 'far': node('right', *HEARS)}
    child = compose(system(nodes), CODE, '--watch')
    child.wait_until_ready()
    pids = [pid_of(child, name) for name in nodes]
    monkeypatch.setenv('ROS_DOMAIN_ID', str(compose.domain_id))
    tell_of_workers(capsys, pids)
    assert run(['restart', '/talker']) == 0
    assert pid_of(child, 'talker', times=2) == pids[0]

    edit(compose, child, system(nodes), CODE.replace(' hears ', ' reads '))
    child.wait_for_line('far reads')
    assert all(map(is_there, pids))

    # The new node cannot start, so the others stay where they are, also if their worker was to
    # have another process.
    bad = {
        'talker': node('right', *TALKS),
        'far': nodes['far'],
        'bad': '{worker: third, on_start: {behaviour: parts:fail}}',
    }
    code = CODE.replace(' hears ', ' gets ')
    edit(compose, child, system(bad), code, fails=True)
    assert not child.matching('far gets')
    other = 'workers: {right: {environment: {SENSOR: front}}}\n'
    edit(compose, child, system(bad, other), code, fails=True)
    assert all(map(is_there, pids))
    assert pid_of(child, 'talker', times=len(child.matching('talker begins'))) == pids[0]
    seen = len(child.matching('far reads'))
    child.wait_for_line('far reads', times=seen + 5)
    # For a moment, it may have run where it was to be.
    assert not [each for each in child.matching('far gets') if each.endswith(f'in {pids[1]}')]
    assert child.stop() == 0
