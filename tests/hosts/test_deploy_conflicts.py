"""Nothing is done if a host lacks something, or has what others wrote."""

import os
import signal
import subprocess
from textwrap import dedent

import pytest

from tests.host_bed import why_there_is_none
from tests.hosts.deployed import FOLDER, UNITS

pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(600),
    pytest.mark.skipif(bool(why_there_is_none()), reason=why_there_is_none()),
]


def test_a_file_that_was_edited_there_is_not_overwritten(project):
    before = project.states()
    edited = f'{FOLDER}/systems/robot/live/files/behaviours/talk.py'
    project.front.run('sed', '-i', 's/hello/good day/', edited)
    project.edit('behaviours/talk.py', 'hello', 'hey')
    told = project.fail()
    assert told.splitlines()[0] == f'error: host front: {edited} was edited there'
    assert project.states() == before
    # Who removes it, as the help says, gets what the files here have.
    project.front.run('rm', edited)
    project.edit('behaviours/talk.py', 'hey', 'hello')
    assert '  + behaviours/talk.py' in project.deploy().stdout
    project.hears('hello')
    assert project.deploy('--plan').stdout == 'front: nothing to do\nrear: nothing to do\n'
    # Who takes the edit over deploys it.
    project.front.run('sed', '-i', 's/hello/good day/', edited)
    project.edit('behaviours/talk.py', 'hello', 'hey')
    project.edit('behaviours/talk.py', 'hey', 'good day')
    project.deploy()
    project.hears('good day')
    project.edit('behaviours/talk.py', 'good day', 'hello')
    project.deploy()


def test_a_unit_that_was_edited_there_is_not_overwritten(project):
    unit = f'{UNITS}/composer-robot@rear.service'
    project.rear.run('sed', '-i', 's/^Restart=.*/Restart=no/', unit)
    before = project.states()
    assert f'host rear: {unit} was edited there' in project.fail()
    assert project.states() == before
    project.rear.run('sed', '-i', 's/^Restart=.*/Restart=on-failure/', unit)
    project.deploy()


def test_a_unit_of_somebody_else_is_not_overwritten(project):
    (project.folder / 'robot.yaml').rename(project.folder / 'other.yaml')
    unit = f'{UNITS}/composer-other@rear.service'
    project.rear.run('sh', '-c', f'echo "# mine" >{unit}')
    told = project.fail(system='other.yaml')
    assert told.splitlines()[0] == (
        f'error: host rear: {unit} is there, and was not written by Composer'
    )
    assert project.rear.run('cat', unit).stdout == '# mine\n'
    project.rear.run('rm', unit)


@pytest.mark.parametrize(
    'lacks',
    [
        {
            'front.python=/nowhere/python3': "host front has no Python '/nowhere/python3'",
            'rear.python=/home/robot/old': 'Python 3.8.10, and Composer needs 3.11 or newer',
        },
        {
            'front.address=10.77.9.9': 'host front (10.77.9.9) cannot be reached',
            'rear.port=23': 'host rear (rear) cannot be reached',
        },
        {
            'front.user=nobody': 'host front (front) accepts none of our keys',
            'rear.address=no-such-name': 'host rear (no-such-name) cannot be reached',
        },
        {
            'front.python=/bin/false': "'/bin/false' to run Composer, which did not answer",
            'rear.python=/home/robot/chatty': 'It printed: hello from bashrc',
        },
        {'front.systemd=system': "for root, and the user of 'front' is not named"},
        {'front.folder=/home/robot/still/mine': "no program may be run from '/home/robot/still/"},
        {'front.folder=/home/robot/small': 'its disk has 21.0 MB'},
        {'front.folder=/home/robot/narrow': 'host front: the disk is full'},
    ],
    ids=lambda lacks: ' '.join(each.partition('=')[0] for each in lacks),
)
def test_what_a_host_lacks_is_said_before_anything_is_done(project, lacks):
    script = """
        cd /home/robot
        mkdir -p small narrow still
        mountpoint -q still || mount -t tmpfs -o noexec,uid=1777 tmpfs still
        mountpoint -q small || mount -t tmpfs -o size=20m,uid=1777 tmpfs small
        mountpoint -q narrow || mount -t tmpfs -o nr_inodes=60,uid=1777 tmpfs narrow
        printf '#!/bin/sh\\nexec python3 -c "import sys; sys.version_info = (3, 8, 10); exec(sys.argv[1])" "$3"\\n' >old
        printf '#!/bin/sh\\necho hello from bashrc\\nexec python3 "$@"\\n' >chatty
        chmod +x old chatty
    """
    for host in (project.front, project.rear):
        assert not host.run('sh', '-c', dedent(script), user='root').returncode
    before = project.states()
    (project.folder / 'robot.yaml').rename(project.folder / 'other.yaml')
    told = project.fail(*[f'--set=hosts.{each}' for each in lacks], system='other.yaml')
    assert [each for each in lacks.values() if each not in told] == []
    for host in (project.front, project.rear):
        assert not host.run(
            *('find', FOLDER, UNITS, '-name', '*other*', '-not', '-path', '*/locks/*'),
            *('-not', '-path', f'{FOLDER}/composer/*'),
        ).stdout
    assert project.states() == before
    project.hears('hello')


def test_a_python_without_venv_is_told(project):
    folder = '/usr/lib/python3.11/venv'
    project.front.run('sh', '-c', f'mount -t tmpfs none {folder}', user='root')
    assert 'host front: its Python has no module venv' in project.fail()
    project.front.run('umount', folder, user='root')


def test_keys_are_those_of_ssh(project):
    ssh = project.bed.home / '.ssh'
    known = (ssh / 'known_hosts').read_text()
    fingerprint = project.bed.run(
        'ssh-keygen', '-lf', str(project.bed.folder / 'front.key.pub')
    ).stdout.split()[1]
    try:
        (ssh / 'known_hosts').write_text('')
        told = project.fail('--host', 'front')
        assert f'error: the key of host front (front) is not known: {fingerprint}' in told
        assert "accept it by 'ssh front'" in told
        rear = project.bed['rear'].public_key
        (ssh / 'known_hosts').write_text(f'front,10.77.1.1 {rear}\n')
        told = project.fail('--host', 'front')
        assert 'host front (front) has another key than known_hosts says' in told
        (ssh / 'known_hosts').write_text(known)
        (ssh / 'id_ed25519').rename(ssh / 'elsewhere')
        assert 'accepts none of our keys' in project.fail('--host', 'front')
        key = f'hosts.front.identity_file={ssh / "elsewhere"}'
        project.deploy('--host', 'front', '--set', key, '--plan')
        (ssh / 'elsewhere.pub').write_text(rear)
        told = project.fail('--host', 'front', '--set', key, '--plan')
        assert f"the key '{ssh}/elsewhere' cannot be used: Public key mismatch" in told
        (ssh / 'elsewhere.pub').unlink()
        told = project.fail('--host', 'front', '--set', f'{key}s', '--plan')
        assert f"host front: the key '{ssh}/elsewheres' cannot be used: No such file" in told
    finally:
        (ssh / 'known_hosts').write_text(known)
        if (ssh / 'elsewhere').exists():
            (ssh / 'elsewhere').rename(ssh / 'id_ed25519')


def test_jumps_and_agents_are_those_of_ssh(project):
    ssh = project.bed.home / '.ssh'
    config = (ssh / 'config').read_text()
    jump = 'Host far\n  HostName 10.77.1.2\n  HostKeyAlias rear\n  ProxyJump front\n'
    agent = project.bed.run('ssh-agent', '-c').stdout.split()
    socket, pid = agent[2].rstrip(';'), int(agent[5].rstrip(';'))
    words = ['deploy', '--plan', '--set', 'hosts.rear.address=far']
    try:
        (ssh / 'config').write_text(jump + config)
        environment = {**project.options['env'], 'SSH_AUTH_SOCK': socket}
        subprocess.run(['ssh-add', '-q', str(ssh / 'id_ed25519')], env=environment, check=True)
        # A key with a passphrase is the agent's, also when it is named.
        (ssh / 'id_ed25519').rename(ssh / 'elsewhere')
        locked = ssh / 'locked'
        locked.write_bytes((ssh / 'elsewhere').read_bytes())
        locked.chmod(0o600)
        project.bed.run('ssh-keygen', '-q', '-p', '-N', 'secret', '-f', str(locked))
        words += ['--set', f'hosts.rear.identity_file={locked}']
        options = project.options | {'env': environment}
        done = project.bed.run(*project.words(*words), **options)
        assert done.returncode == 0, done.stderr
        assert 'rear (far): ' in done.stdout
    finally:
        os.kill(pid, signal.SIGTERM)
        (ssh / 'config').write_text(config)
        if (ssh / 'elsewhere').exists():
            (ssh / 'elsewhere').rename(ssh / 'id_ed25519')
