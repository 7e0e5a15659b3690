"""If a host, the laptop or the network fails, all hosts are as they were before."""

import signal
import threading

import pytest

from composer.errors import ExitCode
from tests.host_bed import why_there_is_none
from tests.hosts.deployed import FOLDER, UNITS
from tests.running import wait_for

pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(600),
    pytest.mark.skipif(bool(why_there_is_none()), reason=why_there_is_none()),
]


@pytest.fixture
def before(project):
    """Return what the hosts run; afterwards they run it again."""
    releases = project.releases()
    yield releases
    wait_for(lambda: project.runs(releases), 'the release before', timeout_sec=60)
    project.hears('hello')


def start(project, *words):
    """Begin a deployment in which the listener takes long to start; return it then."""
    releases = project.releases()
    waits = 'import time\n    while not Path.home().joinpath("go").exists(): time.sleep(0.1)'
    project.edit('behaviours/counting.py', 'def', 'from pathlib import Path\n\n\ndef')
    project.edit('behaviours/counting.py', 'pass', waits)
    project.edit('robot.yaml', 'domain_id: 20', 'domain_id: 23')
    process = project.begin(*words)

    def is_up():
        active, _, release, is_pending = project.state('front')[0]
        return active == 'active' and is_pending and release != releases[0]

    wait_for(is_up, 'front', timeout_sec=90)
    return process


@pytest.mark.long
def test_if_one_host_cannot_start_all_go_back(project, before):
    project.edit('behaviours/counting.py', 'pass', "raise ValueError('no sensor')")
    project.edit('robot.yaml', 'domain_id: 20', 'domain_id: 21')
    done = project.deploy(code=ExitCode.FAILED)
    assert 'ValueError: no sensor' in done.stdout
    assert done.stdout.count('    msg: the release before was restored\n') == 2
    assert done.stderr.startswith('front: failed\nrear: failed\nerror: ')


@pytest.mark.long
def test_a_host_that_is_lost_goes_back_by_itself(project, before):
    process = start(project, '--rollback-after', '15')
    project.rear.cut()
    out, told = process.communicate(timeout=120)
    assert process.returncode == ExitCode.UNREACHABLE, out + told
    assert 'front: failed\nrear: unreachable\n' in told
    assert project.state('front')[0][2] == before[0]
    # Nothing of it can be asked now, and nothing is begun.
    told = project.deploy(code=ExitCode.UNREACHABLE).stderr
    assert told == "error: 'robot' was not deployed: nothing was changed\n"
    project.rear.join()


@pytest.mark.long
def test_two_at_once_are_refused_and_ctrl_c_takes_all_back(project, before):
    process = start(project, '--rollback-after', '30')
    assert 'is being deployed by root@' in project.deploy(code=ExitCode.FAILED).stdout
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert process.returncode == ExitCode.INTERRUPTED
    assert told.endswith('each host that has changed goes back within 30 s\n')


@pytest.mark.long
def test_if_the_laptop_is_gone_the_hosts_go_back(project, before):
    process = start(project, '--rollback-after', '15')
    process.kill()
    process.communicate()


@pytest.mark.long
def test_a_host_without_power_goes_back_when_it_is_on_again(project, before):
    process = start(project)
    project.rear.kill()
    reader = threading.Thread(target=process.communicate)
    reader.start()
    project.rear.boot()
    reader.join(120)
    assert process.returncode in (ExitCode.FAILED, ExitCode.UNREACHABLE)


@pytest.mark.long
def test_the_system_survives_a_boot(project, before):
    project.front.kill()
    project.front.boot()


@pytest.mark.long
def test_a_first_deployment_that_fails_leaves_nothing(project, before):
    (project.folder / 'robot.yaml').rename(project.folder / 'other.yaml')
    project.edit('other.yaml', 'domain_id: 20', 'domain_id: 22')
    project.edit('behaviours/counting.py', 'pass', "raise ValueError('no sensor')")
    done = project.deploy(system='other.yaml', code=ExitCode.FAILED)
    assert done.stdout.count('    msg: all of it was removed again\n') == 2
    for host in (project.front, project.rear):
        assert host.run('ls', f'{FOLDER}/systems').stdout.split() == ['robot']
        assert 'other' not in host.run('ls', UNITS).stdout


@pytest.mark.long
def test_variables_that_the_files_read_are_those_of_each_host(project, monkeypatch):
    monkeypatch.setenv('DUO_TEXT', 'hello of the laptop')
    texts = 'environment: {TEXT: "{{ env(\'DUO_TEXT\') }}"}\n'
    project.edit('robot.yaml', 'version: 1\n', f'version: 1\n{texts}')
    project.edit('behaviours/talk.py', "'hello'", "__import__('os').environ['TEXT']")
    before = project.states()
    assert 'DUO_TEXT' in project.deploy(code=ExitCode.FAILED).stdout
    assert project.states() == before
    for host in (project.front, project.rear):
        write = 'mkdir -p .config/composer; echo \'DUO_TEXT="hello of the host"\' >$0'
        host.run('sh', '-c', write, '.config/composer/robot.env')
    project.deploy()
    project.hears('hello of the host')
    for host in (project.front, project.rear):
        host.run('rm', '-r', '.config/composer')
