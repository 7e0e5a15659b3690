"""`composer new`: what it creates works, and it never writes over anything."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from composer.cli.main import run
from composer.schema import schema_path
from tests.plugin import PLUGIN_OPTIONS

ROOT = Path(__file__).resolve().parents[2]
FILES = {
    '.github/workflows/test.yml',
    '.gitignore',
    '.pre-commit-config.yaml',
    'README.md',
    'behaviours/my_robot.py',
    'configs/my_robot.yaml',
    'pyproject.toml',
    'requirements.txt',
    'schemas/composer.schema.json',
    'schemas/scenario.schema.json',
    'tests/my_robot.scenario.yaml',
    'tests/test_my_robot.py',
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def project(folder):
    assert run(['new', 'my_robot']) == 0
    return folder / 'my_robot'


def texts(project):
    return {
        path.relative_to(project).as_posix(): path.read_text()
        for path in project.rglob('*')
        if path.is_file()
    }


def test_a_ros_package_is_one_with_a_system_that_has_no_errors(folder, capsys):
    assert run(['new', '--ros-package', 'my_robot']) == 0
    assert capsys.readouterr().out.endswith(
        'run it:\n  colcon build --symlink-install\n  . install/setup.sh\n'
        '  composer up my_robot my_robot.yaml\n  colcon test\n'
    )
    package = folder / 'my_robot'
    assert set(texts(package)) == {
        'README.md',
        'interfaces/my_robot_interfaces/msg/Greeting.msg',
        'my_robot/__init__.py',
        'my_robot/behaviours.py',
        'package.xml',
        'resource/my_robot',
        'setup.py',
        'systems/my_robot.yaml',
        'test/my_robot.scenario.yaml',
        'test/test_my_robot.py',
    }
    assert not [path for path, text in texts(package).items() if 'my_system' in path + text]
    assert run(['check', '--strict', str(package)]) == 0
    # Its behaviours are checked with the system, from wherever that is done.
    behaviours = package / 'my_robot' / 'behaviours.py'
    behaviours.write_text(behaviours.read_text().replace('message.text', 'message.txt'))
    assert run(['check', str(package / 'systems')]) == 1
    assert 'unknown-field' in capsys.readouterr().out


@pytest.mark.parametrize('name', ['systems', 'resource'])
def test_no_folder_of_a_ros_package_has_two_meanings(folder, capsys, name):
    assert run(['new', '--ros-package', name]) == 2
    assert f"'{name}' cannot name a ROS package" in capsys.readouterr().err
    assert not list(folder.iterdir())


@pytest.mark.ros
def test_each_command_of_the_readme_works(project, monkeypatch, capsys):
    monkeypatch.chdir(project)
    found = re.findall(r'(?:\$|`)[ ]?composer ([^`#\n>]*)', (project / 'README.md').read_text())
    commands = [words.split() for words in found]
    assert ['schema', '--scenarios'] in commands
    for words in commands:
        # A system runs until it is stopped; its check reads the same words.
        given = ['check', *words[1:]] if words[0] == 'up' else words
        assert given in (['check'], ['test']) or run(given) == 0, capsys.readouterr().err


def run_in(project, *words):
    return subprocess.run(
        [sys.executable, '-m', *words],
        cwd=project,
        env=os.environ | {'PYTHONPATH': str(ROOT), 'PYTHONDONTWRITEBYTECODE': '1'},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )


def test_it_creates_all_that_a_project_needs(folder, capsys):
    assert run(['new', 'my_robot']) == 0
    assert set(texts(folder / 'my_robot')) == FILES
    said = capsys.readouterr().out
    assert all(f'  {path}\n' in said for path in FILES)
    assert said.endswith(
        'run it:\n  cd my_robot\n  composer up configs/my_robot.yaml\n  composer test\n'
    )


def test_nothing_of_the_template_s_name_is_left(project):
    assert not [path for path, text in texts(project).items() if 'my_system' in path + text]


def test_the_system_has_no_errors_and_no_warnings(project):
    assert run(['check', '--strict', str(project)]) == 0


def test_editors_find_the_schema(project):
    config = project / 'configs' / 'my_robot.yaml'
    modeline = config.read_text().splitlines()[0]
    schema = config.parent / re.fullmatch(
        r'# yaml-language-server: \$schema=(.*)', modeline
    ).group(1)
    assert schema.read_text() == schema_path().read_text()


def test_files_for_other_tools_are_what_these_read(project):
    workflow = yaml.safe_load((project / '.github/workflows/test.yml').read_text())
    commands = [step.get('run', '') for step in workflow['jobs']['test']['steps']]
    assert commands[2:] == [
        'pip install -r requirements.txt',
        'composer check --strict --format github configs',
        'python -m pytest',
    ]
    (repository,) = yaml.safe_load((project / '.pre-commit-config.yaml').read_text())['repos']
    own = yaml.safe_load((ROOT / '.pre-commit-hooks.yaml').read_text())[0]
    (hook,) = repository['hooks']
    assert (hook['id'], hook['entry'], hook['types']) == (own['id'], own['entry'], own['types'])


def run_tests_in(project):
    return run_in(project, 'pytest', '-p', 'no:cacheprovider', *PLUGIN_OPTIONS)


@pytest.mark.ros
def test_its_own_tests_pass(project):
    done = run_tests_in(project)
    assert done.returncode == 0, done.stdout + done.stderr
    assert '4 passed' in done.stdout


@pytest.mark.ros
def test_its_scenario_fails_if_the_system_does_not_work(project, monkeypatch, capsys):
    monkeypatch.chdir(project)
    behaviours = project / 'behaviours' / 'my_robot.py'
    behaviours.write_text(behaviours.read_text().replace('Hello', 'Goodbye'))
    assert run(['test']) == 1
    assert 'tests/my_robot.scenario.yaml:8:' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('name', 'near'),
    [
        ('robots/My-Arm', 'robots_my_arm'),
        ('x\n', 'x'),
    ],
)
def test_a_name_is_one_of_a_ros_package(folder, capsys, name, near):
    shown = name.replace('\n', '\n  ')
    assert run(['new', name]) == 2
    assert capsys.readouterr().err == (
        f"error: '{shown}' cannot name a project: use lower-case letters, digits and underscores, "
        f"starting with a letter\n  help: try '{near}'\n"
    )
    assert not list(folder.iterdir())


@pytest.mark.parametrize('name', ['', '7'])
def test_a_name_without_any_letter_has_none_near(folder, capsys, name):
    assert run(['new', name]) == 2
    assert 'help' not in capsys.readouterr().err


def test_a_word_of_python_names_no_project(folder, capsys):
    assert run(['new', 'class']) == 2
    assert 'it is a Python keyword' in capsys.readouterr().err


def test_an_empty_folder_is_filled(folder):
    (folder / 'my_robot').mkdir()
    assert run(['new', 'my_robot']) == 0
    assert set(texts(folder / 'my_robot')) == FILES


def test_a_folder_with_something_in_it_is_left_alone(folder, capsys):
    (folder / 'my_robot').mkdir()
    (folder / 'my_robot' / '.hidden').write_text('mine')
    assert run(['new', 'my_robot']) == 1
    assert capsys.readouterr().err == (
        'error: my_robot already exists and is not empty\n  help: use another name, or move it\n'
    )
    assert texts(folder / 'my_robot') == {'.hidden': 'mine'}


@pytest.mark.parametrize('is_link', [False, True])
def test_a_file_or_a_dangling_link_is_left_alone(folder, capsys, is_link):
    path = folder / 'my_robot'
    path.symlink_to('nowhere') if is_link else path.write_text('mine')
    assert run(['new', 'my_robot']) == 1
    assert 'already exists and is not a folder' in capsys.readouterr().err
    assert path.is_symlink() if is_link else path.read_text() == 'mine'


def test_a_folder_that_cannot_be_written_is_said(folder, capsys, monkeypatch):
    def refuse(path, *arguments, **options):
        raise PermissionError(13, 'Permission denied', str(path))

    monkeypatch.setattr(Path, 'mkdir', refuse)
    assert run(['new', 'my_robot']) == 1
    assert capsys.readouterr().err.endswith(': Permission denied\n')
