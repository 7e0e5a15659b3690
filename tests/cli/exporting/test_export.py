import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from composer.cli import main as cli

SYSTEM = """\
version: 1
description: of {{ env('ROBOT_TOKEN') }}
args:
  speed: {type: double, default: 1.0}
nodes:
  one: {state: {token: "{{ env('ROBOT_TOKEN') }}", place: "{{ env('ROBOT_PLACE', 'here') }}"}}
environment: {ROS_DOMAIN_ID: '31', ROBOT: "{{ env('ROBOT_TOKEN') }}"}
"""
TOKEN = 'very-secret-4711'
FORMS = {'systemd': [], 'compose': [], 'kubernetes': ['--image', 'robot:1']}


@pytest.fixture
def robot(tmp_path, monkeypatch):
    monkeypatch.setenv('ROBOT_TOKEN', TOKEN)
    monkeypatch.delenv('ROBOT_PLACE', raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'pyproject.toml').touch()
    (tmp_path / 'robot.yaml').write_text(SYSTEM)
    return tmp_path / 'robot.yaml'


@pytest.fixture
def export(capsys):
    """Return what exports with some words, and returns exit code, output and errors."""

    def export(form, *words):
        code = cli.run(['export', form, *FORMS[form], *map(str, words)])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return export


@pytest.mark.parametrize('form', FORMS)
def test_values_of_the_environment_stand_in_no_file(export, robot, form):
    code, text, _ = export(form, robot)
    assert (code, TOKEN in text) == (0, False)


def test_a_unit_reads_variables_from_a_file(export, robot):
    _, text, _ = export('systemd', robot)
    assert 'EnvironmentFile=%E/composer/robot.env\n' in text
    assert (
        '# EnvironmentFile: in ~/.config/composer, with a line NAME="value" for each of: '
        'ROBOT_PLACE, ROBOT_TOKEN\n'
    ) in text
    robot.write_text(SYSTEM.replace("env('ROBOT_TOKEN')", "env('ROBOT_TOKEN', 'none')"))
    # Without them here, it starts without them there.
    del os.environ['ROBOT_TOKEN']
    _, text, _ = export('systemd', robot)
    assert 'EnvironmentFile=-%E/composer/robot.env\n' in text


def test_a_compose_file_takes_variables_from_its_environment(export, robot):
    _, text, _ = export('compose', robot)
    advice = 'set it in the environment, or in a file .env beside this one'
    assert yaml.safe_load(text)['services']['robot']['environment'] == [
        'ROS_DOMAIN_ID=31',
        'ROBOT_PLACE',
        f'ROBOT_TOKEN=${{ROBOT_TOKEN?{advice}}}',
    ]


def test_a_pod_takes_variables_from_a_secret(export, robot):
    _, text, _ = export('kubernetes', robot)
    pod = [*yaml.safe_load_all(text)][1]['spec']['template']['spec']
    entries = {each['name']: each for each in pod['containers'][0]['env']}
    assert entries['ROS_DOMAIN_ID']['value'] == '31'
    assert 'ROBOT' not in entries
    assert entries['ROBOT_TOKEN']['valueFrom']['secretKeyRef'] == {
        'name': 'robot',
        'key': 'ROBOT_TOKEN',
        'optional': False,
    }
    assert entries['ROBOT_PLACE']['valueFrom']['secretKeyRef']['optional'] is True


def test_the_value_of_a_variable_is_refused_as_an_argument(export, robot):
    code, text, told = export('systemd', robot, f'--set=nodes.one.description=x {TOKEN}')
    assert (code, text, TOKEN in told) == (1, '', False)
    assert 'an argument has the value of the variable ROBOT_TOKEN' in told
    assert "leave it out: the system reads it itself, with env('ROBOT_TOKEN')" in told


@pytest.mark.parametrize('form', FORMS)
def test_layers_arguments_and_settings_go_into_the_command(export, robot, form):
    layer = robot.with_name('layer.yaml')
    layer.write_text('description: of a layer\n')
    words = [layer, 'speed:=2.5', '--set=nodes.one.description=x', '--ros-args', '-r', 'a:=b']
    _, text, _ = export(form, robot, *words)
    if form == 'systemd':
        line = next(each for each in text.splitlines() if each.startswith('ExecStart='))
        command, folder = shlex.split(line), robot.parent
    elif form == 'compose':
        command, folder = yaml.safe_load(text)['services']['robot']['command'], '/project'
    else:
        pod = [*yaml.safe_load_all(text)][1]['spec']['template']['spec']
        command, folder = pod['containers'][0]['args'], '/project'
    assert command[command.index('up') :] == [
        'up',
        f'{folder}/robot.yaml',
        f'{folder}/layer.yaml',
        'speed:=2.5',
        '--set=nodes.one.description=x',
        '--ros-args',
        '-r',
        'a:=b',
    ]


def test_a_compose_file_in_the_project_names_it_relative_to_itself(export, robot):
    folder = robot.parent
    code, text, told = export('compose', robot, '--output', folder / 'deploy' / 'x')
    assert (code, text, told) == (0, '', f'wrote {folder}/deploy/x/compose.yaml\n')
    written = yaml.safe_load((folder / 'deploy' / 'x' / 'compose.yaml').read_text())
    service = written['services']['robot']
    assert service['build']['context'] == service['volumes'][0]['source'] == '../..'


def test_a_file_of_somebody_else_is_not_overwritten(export, robot):
    folder = robot.parent
    mine = folder / 'compose.yaml'
    mine.write_text('services: {}\n')
    assert export('compose', robot, '--output', folder) == (
        1,
        '',
        f"error: {mine} was not written by 'composer export', and is not overwritten\n"
        '  help: remove it, or write to another folder\n',
    )
    assert mine.read_text() == 'services: {}\n'


def test_a_file_is_written_again_until_somebody_edits_it(export, robot):
    folder = robot.parent
    written = folder / 'composer-robot.service'
    assert export('systemd', robot, '--output', folder)[0] == 0
    first = written.read_text()
    assert export('systemd', robot, 'speed:=3.0', '--output', folder)[0] == 0
    second = written.read_text()
    assert first != second
    written.write_text(second + 'Nice=5\n')
    code, _, told = export('systemd', robot, '--output', folder)
    assert (code, 'was edited since it was exported, and is not overwritten' in told) == (1, True)
    assert written.read_text() == second + 'Nice=5\n'


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (['systemd', '-'], 'standard input cannot be exported'),
        (['kubernetes', 'robot.yaml'], 'Kubernetes runs images, and none is given'),
        (['systemd', '--image', 'x', 'robot.yaml'], '--image is for compose and kubernetes'),
        (['compose', '--user', 'robot.yaml'], '--user and --system are for systemd'),
        (['systemd', 'robot.yaml', 'fast:=1'], "there is no argument 'fast'"),
    ],
)
def test_a_command_line_that_fits_no_form_is_refused(capsys, robot, words, told):
    assert cli.run(['export', *words]) == 2
    assert told in capsys.readouterr().err


def test_a_system_with_errors_is_not_exported(export, robot):
    robot.write_text('version: 1\nnodes: {one: {timers: {t: {period: 1.0}}}}\n')
    code, text, told = export('compose', robot)
    assert (code, text, 'error[' in told) == (1, '', True)


def test_a_project_without_a_common_folder_is_refused(export, robot):
    inventory = Path('/dev/shm/composer-test-inventory.yaml')
    inventory.write_text('description: x\n')
    try:
        code, _, told = export('compose', robot, inventory)
    finally:
        inventory.unlink()
    assert (code, 'are in no folder that a container can be given' in told) == (1, True)


def test_files_that_no_config_map_holds_are_refused(export, robot):
    robot.with_name('big.yaml').write_text(f'description: x\n# {"x" * 1_000_000}\n')
    code, _, told = export('kubernetes', robot, robot.with_name('big.yaml'))
    assert (code, 'a ConfigMap has at most 1 MiB' in told) == (1, True)


def test_an_image_has_what_the_project_asks_for(export, robot):
    robot.with_name('requirements.txt').write_text('numpy\n')
    robot.with_name('pyproject.toml').write_text(
        "[project]\nname='x'\ndependencies=['scipy>=1; python_version > \"3\"', 'rclpy-composer']\n"
    )
    _, text, _ = export('compose', robot)
    inline = yaml.safe_load(text)['services']['robot']['build']['dockerfile_inline']
    lines = inline.replace('$$', '$').splitlines()
    assert 'RUN pip install --no-cache-dir "$COMPOSER"' in lines
    assert 'COPY requirements.txt /tmp/' in lines
    assert 'RUN pip install --no-cache-dir \'scipy>=1; python_version > "3"\'' in lines
    assert not any('gcc' in each for each in lines)


def test_an_export_needs_no_ros(robot):
    probe = (
        'import sys; sys.modules["rclpy"] = None; from composer.cli.main import run;'
        f'sys.exit(run(["export", "systemd", {str(robot)!r}]))'
    )
    result = subprocess.run([sys.executable, '-c', probe], check=False, capture_output=True)
    assert (result.returncode, b'ExecStart' in result.stdout) == (0, True), result.stderr
