"""A system is deployed to two hosts, changed, and removed again."""

import pytest

from tests.host_bed import why_there_is_none
from tests.hosts.deployed import FOLDER, ROOT_THERE, UNITS, Project
from tests.running import wait_for

pytestmark = [
    pytest.mark.ros,
    pytest.mark.timeout(600),
    pytest.mark.skipif(bool(why_there_is_none()), reason=why_there_is_none()),
]
TALK = f'{ROOT_THERE}/live/files/behaviours/talk.py'


@pytest.mark.long
def test_a_system_is_deployed_edited_and_removed(bed, tmp_path):
    project = Project(bed, tmp_path / 'duo')
    project.ensure()
    project.hears('hello')
    done = project.deploy()
    assert done.stderr == 'front: nothing to do\nrear: nothing to do\nrobot: nothing to do\n'

    before, pids = project.states(), project.pids()
    project.edit('behaviours/talk.py', 'hello', 'good day')
    planned = project.deploy('--plan')
    assert '    - reload\n' in planned.stdout
    assert "    - '+    return {''data'': ''good day''}'" in planned.stdout
    assert planned.stderr.endswith('robot: 2 hosts would be changed\n')
    assert project.states() == before
    project.hears('hello')
    assert project.front.run('ls', f'{ROOT_THERE}/releases').stdout.split() == [before[0][0][2]]

    assert project.deploy().stderr.endswith('robot: 2 hosts changed\n')
    project.hears('good day')
    assert project.pids() == pids

    # What somebody edits there is not overwritten.
    before = project.states()
    project.front.run('sed', '-i', '1i # mine', TALK)
    project.edit('behaviours/talk.py', 'good day', 'good night')
    assert f'{TALK} was edited there' in ' '.join(project.deploy(code=1).stdout.split())
    assert project.states() == before
    project.front.run('sed', '-i', '1d', TALK)

    # Nothing is to run on the rear any more: nothing is left there but what others wrote.
    project.edit('robot.yaml', 'host: rear', 'host: front')
    project.rear.run('sed', '-i', '1i # mine', TALK)
    project.rear.run('touch', f'{ROOT_THERE}/map')
    assert project.deploy().stderr.endswith('robot: 2 hosts changed\n')
    wait_for(lambda: project.front.run('cat', 'heard').stdout == 'good night', 'the listener')
    assert project.state('rear')[0] == ('inactive', '', '', False)
    assert project.rear.run('find', FOLDER, '-type', 'f').stdout.split() == [
        f'{FOLDER}/edited/robot/files/behaviours/talk.py',
        f'{ROOT_THERE}/map',
    ]
    project.deploy('--remove')
    assert project.front.run('ls', FOLDER).returncode
    for host in (project.front, project.rear):
        assert not host.run('find', UNITS, '-name', '*composer*').stdout
