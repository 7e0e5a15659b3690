"""`composer up FILE [NAME:=VALUE]...`: the words of a file's own, and its help."""

import io
import sys
from pathlib import Path

import pytest

from composer.cli import main as cli

ROOT = Path(__file__).resolve().parents[3]

CALCULATOR_ARGUMENTS = """the file declares
  a (integer, required): The first number.
  b (integer, required): The second number.
  operation (string, one of '', add, subtract, default ''): What the server does; empty for no change.
"""
INDENTED = CALCULATOR_ARGUMENTS.replace('\n  ', '\n    ')


@pytest.fixture
def run(capsys, monkeypatch):
    """Return exit code, standard output and standard error of a command."""
    monkeypatch.chdir(ROOT)

    def run(*arguments):
        code = cli.run(list(arguments))
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


@pytest.mark.parametrize('option', ['--help', '-h'])
@pytest.mark.parametrize('first', [True, False])
def test_help_after_or_before_a_file_shows_its_arguments(run, option, first):
    file = 'configs/calculator_client.yaml'
    code, out, err = run('up', *([option, file] if first else [file, option]))
    assert (code, err) == (0, '')
    usage, arguments = out.split(f'\n{file}: ')
    assert usage.startswith(
        'Usage: composer up [OPTIONS] [PACKAGE] FILE [LAYER]... [NAME:=VALUE]...\n'
    )
    assert arguments == CALCULATOR_ARGUMENTS


def test_help_of_a_file_without_arguments_says_so(run):
    code, out, _ = run('up', 'configs/greeter.yaml', '--help')
    assert code == 0
    assert out.endswith('\nconfigs/greeter.yaml: the file declares no arguments\n')


def test_help_of_a_file_that_is_not_there_is_still_help(run):
    code, out, _ = run('up', 'nowhere.yaml', '--help')
    assert code == 0
    assert out.endswith('\nnowhere.yaml: the file cannot be read\n')


def test_words_that_do_not_fit_are_an_error_of_usage_that_shows_the_declared_ones(run):
    words = ['ten', 'c:=3', 'operation:=divide']
    assert run('up', 'configs/calculator_client.yaml', *words) == (
        2,
        '',
        "error: there is no argument 'c'; 'a': expected an integer, got 'ten'; 'b' is missing; "
        f"'operation': 'divide' is not one of '', add, subtract\n  help: {INDENTED}",
    )


@pytest.mark.parametrize('option', ['--nope=3', '-xyz', '--log-levle'])
def test_an_unknown_option_is_an_error_and_no_value(run, option):
    code, out, err = run('up', 'configs/calculator_client.yaml', '1', option)
    assert (code, out) == (2, '')
    assert f'no such option {option!r}' in err or f'no such option: {option}' in err


def test_an_option_of_ros_is_shown_where_it_goes(run):
    code, _, err = run('up', 'configs/calculator_client.yaml', '--params-file', 'a b.yaml')
    assert code == 2
    assert "write '--ros-args --params-file 'a b.yaml''" in err


def test_negative_numbers_are_values_and_no_options(run):
    code, _, err = run('up', 'configs/calculator_client.yaml', '-5', '-6', '-7')
    assert code == 2
    assert err.startswith("error: 'operation': '-7' is not one of '', add, subtract\n")


def test_a_file_whose_declarations_are_wrong_is_reported_before_its_words(run, tmp_path):
    path = tmp_path / 'system.yaml'
    path.write_text('version: 1\nargs: {a: {defualt: 3}}\nnodes: {}\n')
    code, out, err = run('up', str(path), 'b:=3')
    assert (code, out) == (1, '')
    assert (
        err.splitlines()[0]
        == f"{path}:2:12: error[unknown-key]: unknown key 'defualt' in argument 'a'"
    )


SYSTEM = """
version: 1
args: {text: {type: string}, period: {default: 0.05}, name: {default: talker}}
nodes:
  "{{ name }}":
    timers:
      say: {period: "{{ period }}", behaviour: parts:say, with: {text: "{{ text }}", twice: "<{{ text }}>"}}
"""

CODE = """
def say(node, text, twice):
    node.logger.info(f'{text!r} {twice} {node.name}')
    node.shutdown()
"""


@pytest.mark.ros
def test_a_system_runs_with_the_values_that_are_given(compose):
    pytest.importorskip('rclpy')
    child = compose(SYSTEM, CODE, '-7', 'name:=speaker')
    assert child.wait() == 0, child.output
    assert child.matching('[speaker]') == ["[INFO] [speaker]: '-7' <-7> speaker"]


# What FILE is


@pytest.mark.parametrize('command', ['up', 'show', 'graph'])
def test_of_a_folder_its_systems_are_listed(run, tmp_path, command):
    (tmp_path / 'a').mkdir()
    (tmp_path / 'a/rover.yaml').write_text('version: 1\nnodes: {}\n')
    code, out, err = run(command, str(tmp_path))
    assert (code, out) == (2, '')
    assert err == (
        f"error: '{tmp_path}' is a folder, and a system is one file\n"
        f'  help: it holds\n    {tmp_path}/a/rover.yaml\n'
    )


@pytest.mark.parametrize(
    ('path', 'advice'),
    [
        ('configs/robt.yaml', "did you mean 'configs/robot.yaml'?"),
        ('confgs/robot.yaml', "did you mean 'configs/robot.yaml'?"),
        ('configs/parts/zzz.yaml', "in 'configs/parts' there are: arm.yaml"),
        ('configs/robot.yaml/x', "the folders in 'configs' are: parts, programs, sites"),
    ],
)
def test_for_a_missing_file_the_nearest_is_named(run, path, advice):
    code, _, err = run('up', path)
    assert code == 1
    assert err.startswith(f'{path}: error[unreadable-file]: cannot read the file: No')
    assert err.splitlines()[1] == f'  help: {advice}'


def test_a_dash_is_standard_input(run, monkeypatch):
    text = io.BytesIO(b'version: 1\nargs: {a: 1}\nnodes: {"rover_{{ a }}": {}}\n')
    monkeypatch.setattr(sys, 'stdin', io.TextIOWrapper(text))
    assert run('show', '-', 'a:=7')[:2] == (0, 'version: 1\nnodes:\n  rover_7: {}\n')


def test_standard_input_cannot_be_watched(run):
    assert run('up', '--watch', '-') == (
        2,
        '',
        'error: --watch cannot watch standard input, which is read once\n  help: give a file\n',
    )


@pytest.mark.parametrize('command', ['check', 'show', 'graph', 'plan', 'export systemd'])
@pytest.mark.parametrize('value', ['/tmp/m.yaml', 'x.scenario.yaml'])
def test_a_word_with_a_name_is_an_argument_even_if_it_ends_like_a_file(
    run, tmp_path, command, value
):
    file = tmp_path / 'x.yaml'
    file.write_text(
        "version: 1\nargs: {map: ''}\nprocesses: {p: {command: [echo, '{{ map }}']}}\n"
    )
    files = [str(file)] * (2 if command == 'plan' else 1)
    code, out, err = run(*command.split(), *files, f'map:={value}')
    assert code == 0, out + err
    if command == 'show':
        assert value in out
