"""A system is deployed to two hosts, changed, and removed again."""

from pathlib import Path

import pytest

from tests.host_bed import why_there_is_none
from tests.hosts.deployed import FOLDER, UNITS, Project
from tests.running import wait_for

pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(600),
    pytest.mark.skipif(bool(why_there_is_none()), reason=why_there_is_none()),
]


def test_each_host_gets_its_part_and_runs_it(bed, tmp_path):
    project = Project(bed, tmp_path / 'duo')
    project.run('deploy', '--remove')
    bed.give_packages()
    done = project.deploy()
    assert done.stderr.splitlines()[-1] == 'robot: 2 hosts changed'
    assert '  + behaviours/talk.py\n' in done.stdout
    assert project.runs(['releases/1'] * 2)
    project.hears('hello')
    bed.keep_packages()


def test_without_a_change_nothing_is_done(project):
    before = project.states()
    done = project.deploy()
    assert sorted(done.stdout.splitlines()) == ['front: nothing to do', 'rear: nothing to do']
    assert project.states() == before


def test_one_changed_file_goes_over_and_the_system_runs_on(project):
    pids = project.pids()
    project.edit('behaviours/talk.py', 'hello', 'good day')
    lines = project.deploy().stdout.splitlines()
    assert lines[:2] == ['front: reload', '  ~ behaviours/talk.py']
    assert lines[2].endswith(' kB to bring')
    project.hears('good day')
    assert project.pids() == pids
    project.edit('behaviours/talk.py', 'good day', 'hello')
    project.edit('hosts.yaml', 'address: front', 'address: front, description: of the cab')
    project.deploy()
    project.hears('hello')
    assert project.pids() == pids


def test_a_plan_changes_nothing(project):
    before = project.states()
    project.edit('behaviours/talk.py', 'hello', 'good day')
    assert '  ~ behaviours/talk.py' in project.deploy('--plan').stdout
    assert project.states() == before
    project.hears('hello')


def test_a_node_that_moves_leaves_the_one_host_before_it_comes_to_the_other(project):
    pids = project.pids()
    project.edit('robot.yaml', 'host: rear', 'host: front')
    project.edit('robot.yaml', 'nodes:', 'nodes:\n  spare: {host: rear}')
    lines = project.deploy().stderr.splitlines()
    assert [each.partition(':')[0] for each in lines if 'reloaded' in each] == ['rear', 'front']
    assert project.pids() == pids


def test_a_host_that_is_left_stops_unless_all_go_back(project):
    releases = project.releases()
    project.edit('robot.yaml', 'host: rear', 'host: front')
    project.edit('robot.yaml', 'domain_id: 20', 'domain_id: 24')
    project.edit('hosts.yaml', ', rear: {address: rear}', '')
    project.edit('behaviours/counting.py', 'pass', "raise ValueError('no sensor')")
    told = project.fail()
    assert 'rear: stopped\n' in told
    assert '  rear: the release before was restored' in told
    assert project.runs(releases)
    project.rear.lose(100)
    told = project.fail()
    project.rear.lose(0)
    assert 'host rear (rear) cannot be reached: ' in told
    assert "help: '--leave rear' leaves it as it is, and forgets it" in told
    assert 'rear' not in project.deploy('--plan', '--leave', 'rear').stdout
    assert project.runs(releases)
    project.hears('hello')
    project.edit('behaviours/counting.py', "raise ValueError('no sensor')", 'pass')
    project.edit('robot.yaml', 'domain_id: 24', 'domain_id: 20')
    done = project.deploy()
    plan = 'rear: remove (nothing of the system is to run there any more)\n  - listener\n'
    assert plan in done.stdout
    assert done.stderr.index('rear: stopped') < done.stderr.index('front: reloaded')
    assert done.stderr.endswith('rear: removed\nrobot: 2 hosts changed\n')
    wait_for(lambda: project.front.run('cat', 'heard').stdout == 'hello', 'the listener')
    assert project.state('rear')[0] == ('inactive', '', '', False)
    assert project.rear.run('ls', FOLDER).returncode


def test_a_host_of_the_inventory_that_is_left_can_be_stopped(project):
    project.edit('robot.yaml', 'host: rear', 'host: front')
    assert project.run('down', '--host', 'rear').stdout == 'robot@rear: stopped\n'
    assert [state[0] for state, _ in project.states()] == ['active', 'inactive']
    assert project.deploy('--remove', '--host', 'rear').stderr == 'rear: removed\n'
    assert project.rear.run('ls', FOLDER).returncode
    told = 'rear: there is nothing of robot\n'
    assert project.deploy('--remove', '--host', 'rear').stderr == told


def test_the_system_survives_a_boot(project):
    # Each host numbers its releases itself.
    before = [state for state, _ in project.states()]
    project.front.kill()
    project.front.boot()
    wait_for(lambda: [state for state, _ in project.states()] == before, 'front')
    project.hears('hello')


def test_what_is_removed_leaves_nothing_but_what_others_wrote(project):
    Path(project.folder / 'keep').touch()
    live = f'{FOLDER}/systems/robot/live/files'
    project.rear.run('sed', '-i', '1i # mine', f'{live}/robot.yaml')
    project.rear.run('touch', f'{FOLDER}/systems/robot/map')
    done = project.run('deploy', '--remove')
    assert not done.returncode, done.stderr
    assert not project.rear.run('ls', f'{FOLDER}/edited/robot/map').returncode
    kept = f'{FOLDER}/edited/robot/files/robot.yaml'
    assert f'rear: {kept} was edited there, and is kept' in done.stderr
    assert project.rear.run('head', '-n1', kept).stdout == '# mine\n'
    assert project.front.run('ls', FOLDER).returncode
    for host in (project.front, project.rear):
        assert not host.run('find', UNITS, '-name', '*composer*').stdout


def test_variables_that_the_files_read_are_those_of_each_host(project, monkeypatch):
    monkeypatch.setenv('DUO_TEXT', 'hello of the laptop')
    monkeypatch.delenv('DUO_OTHER', raising=False)
    texts = "environment: {TEXT: \"{{ env('DUO_TEXT') ~ env('DUO_OTHER', '') }}\"}\n"
    project.edit('robot.yaml', 'version: 1\n', f'version: 1\n{texts}')
    project.edit('behaviours/talk.py', "'hello'", "__import__('os').environ['TEXT']")
    before = project.states()
    file = '.config/composer/robot.env'
    told = project.fail()
    assert told == (
        'error: host front: not set there: DUO_TEXT\n'
        '  host rear: not set there: DUO_TEXT\n'
        '  help: the files read them by env(…): there, write NAME="value" into '
        f'/home/robot/{file}\n'
    )
    assert project.states() == before
    given = '# of this host\\nDUO_TEXT="hello of\\\\\\n the host"\\nDUO_OTHER=!\\n'
    for host in (project.front, project.rear):
        host.run('sh', '-c', f"mkdir -p .config/composer; printf '{given}' >{file}")
    lines = project.deploy().stdout.splitlines()
    assert any(line.startswith('front: restart') for line in lines)
    project.hears('hello of the host!')
    for host in (project.front, project.rear):
        host.run('rm', '-r', '.config/composer')
