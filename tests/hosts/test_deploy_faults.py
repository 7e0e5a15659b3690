"""If a host, the laptop or the network fails, all hosts are as they were before."""

import signal
import threading

import pytest

from tests.host_bed import why_there_is_none
from tests.hosts.deployed import FOLDER, UNITS
from tests.running import wait_for

pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(600),
    pytest.mark.skipif(bool(why_there_is_none()), reason=why_there_is_none()),
]


def test_if_one_host_cannot_start_all_go_back(project):
    releases = project.releases()
    project.edit('behaviours/counting.py', 'pass', "raise ValueError('no sensor')")
    project.edit('robot.yaml', 'domain_id: 20', 'domain_id: 21')
    told = project.fail()
    assert 'error: host rear: the system did not start' in told
    assert 'no sensor' in told
    assert '  front: the release before was restored' in told
    assert project.runs(releases)
    project.hears('hello')


def test_a_host_that_cannot_take_an_edit_goes_back_like_the_others(project):
    # What is read where it starts is in no plan.
    project.edit('robot.yaml', 'nodes:', 'environment: {SITE: {file: site.txt}}\nnodes:')
    project.write('site.txt', 'lab\n')
    project.deploy()
    releases = project.releases()
    project.write('site.txt', 'field\n')
    assert 'front: reload\n' in project.deploy('--plan').stdout
    told = project.fail()
    assert 'environment.SITE cannot change while the system runs' in told
    assert project.runs(releases)
    project.hears('hello')


def test_a_first_deployment_that_fails_leaves_nothing(project):
    releases = project.releases()
    (project.folder / 'robot.yaml').rename(project.folder / 'other.yaml')
    project.edit('other.yaml', 'domain_id: 20', 'domain_id: 22')
    project.edit('behaviours/counting.py', 'pass', "raise ValueError('no sensor')")
    told = project.fail(system='other.yaml')
    assert '  front: all of it was removed again' in told
    for host in (project.front, project.rear):
        assert host.run('ls', f'{FOLDER}/systems').stdout.split() == ['robot']
        assert 'other' not in host.run('ls', UNITS).stdout
    assert project.runs(releases)


def test_what_is_killed_on_a_host_comes_back_once(project):
    project.edit('robot.yaml', '    host: front\n', '    host: front\n    worker: voice\n')
    project.deploy()
    unit = 'composer-robot@front.service'

    def find(part):
        listed = project.front.run('pgrep', '--full', part).stdout.split()
        return [int(each) for each in listed]

    def kill(part):
        (pid,) = find(part)
        project.front.run('kill', '-KILL', str(pid))
        wait_for(lambda: len(find(part)) == 1 and find(part) != [pid], f'{part} again')
        project.hears('hello')

    kill('worker_program.py voice')
    assert project.front.run('systemctl', '--user', 'is-active', unit).stdout == 'active\n'
    before = find('worker_program.py voice')
    kill('m composer up')
    assert len(find('worker_program.py voice')) == 1
    assert find('worker_program.py voice') != before
    assert len(find('processes/guardian.py')) == 1
    wait_for(lambda: 'robot@front  running' in project.run('ps').stdout, 'its answer')


def starting(project):
    """Begin a deployment in which the listener takes long to start; return it then."""
    waits = 'import time\n    while not Path.home().joinpath("go").exists(): time.sleep(0.1)'
    project.edit('behaviours/counting.py', 'def', 'from pathlib import Path\n\n\ndef')
    project.edit('behaviours/counting.py', 'pass', waits)
    project.edit('robot.yaml', 'domain_id: 20', 'domain_id: 23')
    process = project.begin()
    wait_for(
        lambda: project.state('front')[0][:1] == ('active',) and project.state('front')[0][3],
        'front',
    )
    return process


def test_two_deployments_at_once_are_refused(project):
    releases = project.releases()
    process = starting(project)
    assert "error: host front: 'robot' is being deployed by root@" in project.fail()
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 130
    assert project.runs(releases)
    assert 'front: the release before was restored' in told


def test_if_the_laptop_is_gone_the_hosts_go_back(project):
    releases = project.releases()
    process = starting(project)
    process.kill()
    process.communicate()
    wait_for(lambda: project.runs(releases), 'the release before')
    project.hears('hello')


def test_a_host_without_power_goes_back_when_it_is_on_again(project):
    releases = project.releases()
    process = starting(project)
    project.rear.kill()
    reader = threading.Thread(target=process.communicate)
    reader.start()
    project.rear.boot()
    reader.join(60)
    assert process.returncode == 1
    wait_for(
        lambda: project.state('rear')[0][:3] == ('active', 'enabled', releases[1]),
        'rear',
    )
    project.hears('hello')
    # The next deployment finds what is left.
    project.restore()
    assert 'rear: an earlier deployment was cut off' in project.deploy().stderr
    assert project.runs(releases)


def test_a_host_that_is_cut_off_goes_back_by_itself(project):
    releases = project.releases()
    process = starting(project)
    project.rear.cut()
    _, told = process.communicate(timeout=60)
    assert process.returncode == 1
    assert 'error: host rear was lost' in told
    assert '  front: the release before was restored' in told
    project.rear.join()
    wait_for(lambda: project.runs(releases), 'the release before')
    project.hears('hello')
