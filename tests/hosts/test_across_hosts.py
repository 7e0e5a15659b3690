"""Commands that are given files ask all hosts of these: each answers, or is a line of its own."""

import json
import shlex
import signal
import subprocess

import pytest

from tests.host_bed import why_there_is_none
from tests.hosts.deployed import FOLDER
from tests.running import wait_for

pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(600),
    pytest.mark.skipif(bool(why_there_is_none()), reason=why_there_is_none()),
]


def test_ps_lists_the_parts_and_says_which_host_is_not_there(project):
    done = project.run('ps')
    assert done.returncode == 0, done.stderr
    assert [line.split()[:2] for line in done.stdout.splitlines()[1:3]] == [
        ['robot@front', 'running'],
        ['robot@rear', 'running'],
    ]
    words = ['--host', 'rear', '--set', 'hosts.rear.address=10.77.1.2']
    done = project.run('ps', *words)
    # On a busy computer, lines about late ticks come after the table.
    assert 'robot@front' not in done.stdout
    assert done.stdout.splitlines()[1].split()[:2] == ['robot@rear', 'running']
    project.rear.lose(100)
    done = project.run('ps', '--format', 'json')
    project.rear.lose(0)
    assert done.returncode == 1
    front, rear = json.loads(done.stdout)['systems']
    assert (front['name'], front['host'], front['nodes']) == ('robot@front', 'front', ['/talker'])
    assert rear == {'name': 'robot@rear', 'state': 'unreachable'}
    assert done.stderr.startswith('error: host rear (rear) cannot be reached: ')


def test_ps_does_not_take_a_part_that_cannot_be_asked_for_one_that_is_not_there(project):
    script = f'{FOLDER}/systems/robot/live/composer'
    broken = '#!/bin/sh\necho no graph >&2\nexit 1\n'
    kept = project.front.run('cat', script).stdout
    project.front.run('sh', '-c', f'cat >{script}', stdin=broken)
    done = project.run('ps')
    project.front.run('sh', '-c', f'cat >{script}', stdin=kept)
    assert done.returncode == 1
    assert 'robot@front  no answer' in done.stdout
    assert done.stderr == 'error: host front: the part runs, and does not answer\nno graph\n'


def test_parts_are_asked_by_a_discovery_server_that_only_ssh_here_knows_by_its_name(project):
    network = '{discovery: discovery_server, server: front, domain_id: 20}'
    project.edit('robot.yaml', '{discovery: multicast, domain_id: 20}', network)
    project.deploy()
    project.hears('hello')
    done = project.run('ps')
    assert done.returncode == 0, done.stderr
    project.edit('behaviours/listen.py', 'message.data)', "message.data + '!')")
    assert 'rear: reload\n' in project.deploy().stdout
    project.hears('hello!')


def test_top_shows_the_entities_of_all_parts(project):
    done = project.run('top', '--format', 'json')
    assert done.returncode == 0, done.stderr
    entities = json.loads(done.stdout)['entities']
    assert {each['node'] for each in entities} == {'/talker', '/listener'}


def test_top_draws_all_hosts_on_a_screen_until_one_is_lost(project, terminal):
    options = project.options
    variables = [f'{key}={options["env"][key]}' for key in ('HOME', 'PYTHONPATH', 'PATH')]
    command = shlex.join(['env', *variables, *project.bed.command(*project.words('top'))])
    terminal.run(f'cd {options["cwd"]}; {command}', columns=140)
    terminal.shows(
        'robot: 3 of 3 entities', '/talker: timer tick', '/listener: subscription', 'HOST'
    )
    project.rear.kill()
    terminal.shows('robot: 2 of 2 entities', '/talker: timer tick', 'host rear')
    project.rear.boot()
    terminal.shows('robot: 3 of 3 entities', '/listener: subscription')
    terminal.type('q')
    terminal.shows('exit code 0')
    wait_for(
        lambda: 'composer top' not in project.front.run('ps', '-eo', 'args').stdout,
        'the end of what the screen has started',
    )


def test_logs_have_the_host_at_each_line(project):
    done = project.run('logs')
    assert done.returncode == 0, done.stderr
    assert any(
        line.startswith('front | ') and 'talks' in line for line in done.stdout.splitlines()
    )


def test_logs_that_follow_have_each_line_once_also_of_a_host_that_was_lost(project, tmp_path):
    unit = 'composer-robot@rear.service'
    shown = project.rear.run('systemctl', '--user', 'show', '-P', 'ExecMainStartTimestamp', unit)
    journal = ['journalctl', f'--user-unit={unit}', f'--since={shown.stdout.strip()}', '-o', 'cat']
    out, told = tmp_path / 'out', tmp_path / 'told'
    words = project.bed.command(*project.words('logs', '-f'))
    with (
        out.open('w') as output,
        told.open('w') as errors,
        subprocess.Popen(words, stdout=output, stderr=errors, **project.options) as process,
    ):

        def has_all():
            lines = [line.partition(' | ') for line in out.read_text().splitlines()]
            assert {host.strip() for host, *_ in lines} <= {'front', 'rear'}
            rear = [text for host, _, text in lines if host.strip() == 'rear']
            return rear and rear == project.rear.run(*journal).stdout.splitlines()

        wait_for(has_all, 'what rear has said')
        project.rear.run('systemctl', 'stop', 'ssh', user='root')
        project.rear.run('pkill', '-KILL', '-x', 'sshd', user='root')
        wait_for(lambda: 'host rear' in told.read_text(), 'the loss')
        project.rear.run('systemctl', '--user', 'restart', unit)
        project.rear.run('systemctl', 'start', 'ssh', user='root')
        wait_for(lambda: 'host rear is there again\n' in told.read_text(), 'rear')
        wait_for(has_all, 'what rear has said meanwhile')
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 130
    lost, again = told.read_text().splitlines()
    assert lost.startswith('error: host rear (rear) was lost')
    assert again == 'host rear is there again'


def test_logs_that_follow_fail_if_a_host_was_never_there(project):
    words = project.words('logs', '-f', '--set=hosts.rear.port=23')
    pipe = subprocess.PIPE
    with subprocess.Popen(
        project.bed.command(*words), stdout=pipe, stderr=pipe, text=True, **project.options
    ) as process:
        assert process.stderr.readline().startswith('error: host rear (rear) cannot be reached')
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
    assert process.returncode == 1


def test_what_is_down_stays_down_until_it_is_deployed(project):
    done = project.run('reload')
    assert (done.returncode, done.stdout) == (
        0,
        'robot@front: nothing has changed\nrobot@rear: nothing has changed\n',
    )
    begun = project.front.run('date', '+%s').stdout.strip()
    done = project.run('down')
    assert (done.returncode, done.stdout) == (0, 'robot@front: stopped\nrobot@rear: stopped\n')
    assert [state[0] for state, _ in project.states()] == ['inactive', 'inactive']
    journal = ['journalctl', '--user-unit=composer-robot@*', f'--since=@{begun}', '-o', 'cat']
    for host in (project.front, project.rear):
        said = host.run(*journal).stdout
        # All its processes have ended by themselves.
        assert 'Stopped ' in said
        assert 'SIGKILL' not in said
    done = project.run('ps')
    assert (done.returncode, done.stdout.count('not running')) == (1, 2)
    assert project.run('reload').returncode == 1
    lines = project.deploy().stdout.splitlines()
    assert sorted(lines) == ['front: start', 'rear: start']
    wait_for(lambda: project.states()[0][0][0] == 'active', 'the system')


def test_a_host_without_the_system_says_so(project):
    (project.folder / 'robot.yaml').rename(project.folder / 'other.yaml')
    done = project.run('ps', system='other.yaml')
    assert (done.returncode, done.stdout.count('not deployed')) == (1, 2)


def test_files_without_hosts_cannot_be_asked_for(project):
    project.write('hosts.yaml', 'nodes: {}\n')
    project.edit('robot.yaml', 'host: front', '')
    project.edit('robot.yaml', 'host: rear', '')
    done = project.run('ps')
    assert done.returncode == 2
    assert done.stderr == (
        "error: 'robot' declares no hosts\n  help: give the layer that has 'hosts:'\n"
    )
