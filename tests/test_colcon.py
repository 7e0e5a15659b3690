"""A workspace of Composer and a package that `composer new --ros-package` creates, with colcon."""

import os
import shutil
import subprocess
import sys

import pytest

from composer.application.file_selection import walk_yaml_files
from composer.cli.main import run
from tests.running import ROOT, wait_for

pytest.importorskip('colcon_ros')

# All that colcon reads of Composer.
SOURCES = ('behaviours', 'composer', 'configs', 'resource', 'schemas')
FILES = ('README.md', 'package.xml', 'pyproject.toml', 'setup.py')


@pytest.fixture
def workspace(tmp_path, monkeypatch):
    """Return a workspace with both packages, as one gets it by cloning."""
    source = tmp_path / 'src'
    (source / 'composer').mkdir(parents=True)
    for name in SOURCES:
        shutil.copytree(
            ROOT / name, source / 'composer' / name, ignore=shutil.ignore_patterns('__pycache__')
        )
    for name in FILES:
        shutil.copy(ROOT / name, source / 'composer')
    monkeypatch.chdir(source)
    assert run(['new', '--ros-package', 'my_robot']) == 0
    monkeypatch.chdir(tmp_path)
    return tmp_path


def colcon(*words, code=0):
    """Run colcon; return what it printed."""
    quiet = () if words[0] == 'test-result' else ('--event-handlers', 'console_direct-')
    done = subprocess.run(
        [sys.executable, '-m', 'colcon', *words, *quiet],
        env={name: value for name, value in os.environ.items() if name != 'PYTHONPATH'},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def source_environment(workspace):
    """Return the variables after `. install/setup.sh`."""
    done = subprocess.run(
        ['sh', '-c', '. install/setup.sh && env -0'],
        cwd=workspace,
        env={name: value for name, value in os.environ.items() if name != 'PYTHONPATH'},
        capture_output=True,
        text=True,
        check=True,
    )
    return dict(line.split('=', 1) for line in done.stdout.split('\0') if line)


@pytest.mark.ros
@pytest.mark.long
@pytest.mark.parametrize(
    'options',
    [[], ['--symlink-install', '--merge-install']],
    ids=['isolated', 'merged and linked'],
)
def test_a_workspace_is_built_sourced_run_and_tested(
    workspace, options, domain_id, shared_cache, monkeypatch
):
    monkeypatch.setenv('XDG_CACHE_HOME', str(shared_cache))
    colcon('build', *options)
    environment = source_environment(workspace)
    is_linked = '--symlink-install' in options
    module = (workspace / ('build' if is_linked else 'install')).as_posix()

    def composer(*words, code=0):
        done = subprocess.run(
            ['composer', *words],
            cwd='/',
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout

    where = [sys.executable, '-c', 'import composer; print(composer.__file__)']
    assert subprocess.check_output(where, text=True, cwd='/', env=environment).startswith(module)
    assert composer('--version').startswith('composer, version ')
    assert composer('check', '--strict', 'my_robot').endswith('my_robot.yaml: ok, 2 nodes\n')
    composer('check', '--strict', 'rclpy_composer', 'greeter.yaml')
    if not is_linked:
        colcon('test', '--packages-select', 'my_robot')
        assert 'Summary: 3 tests, 0 errors, 0 failures, 0 skipped' in colcon('test-result')
        return
    # Of a workspace, what colcon builds and installs is not looked at.
    assert set(walk_yaml_files(workspace)) == set(walk_yaml_files(workspace / 'src'))
    behaviours = workspace / 'src/my_robot/my_robot/behaviours.py'
    log = workspace / 'up.log'
    with log.open('w') as stream:
        words = ['composer', 'up', 'my_robot', 'my_robot.yaml', '--watch']
        system = subprocess.Popen(words, cwd='/', env=environment, stdout=stream, stderr=stream)
    try:
        wait_for(lambda: 'I heard greeting 1: Hello world!' in log.read_text(), 'a greeting')
        behaviours.write_text(behaviours.read_text().replace('I heard', 'I saw'))
        wait_for(lambda: 'I saw greeting' in log.read_text(), 'the edited behaviour')
        config = workspace / 'src/my_robot/systems/my_robot.yaml'
        config.write_text(config.read_text().replace('world', 'moon'))
        wait_for(lambda: 'Hello moon!' in log.read_text(), 'the edited system')
    finally:
        system.terminate()
        assert system.wait(30) in (0, 143, -15), log.read_text()
    behaviours.write_text(behaviours.read_text().replace('message.text', 'message.txt'))
    assert "has no field 'txt'" in composer('check', 'my_robot', code=1)
    behaviours.write_text(behaviours.read_text().replace('message.txt', 'message.text'))
    # What is linked is what the tests run: they fail as the source is now.
    colcon('test', '--packages-select', 'my_robot', *options[1:])
    failed = colcon('test-result', '--verbose', code=1)
    assert 'Summary: 3 tests, 0 errors, 1 failure' in failed, failed
