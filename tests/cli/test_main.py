"""The command line: its arguments, output and exit codes."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import composer
from composer.cli import main as cli
from composer.errors import ComposerError, UsageError

ROOT = Path(composer.__file__).parents[1]
GREETER = ROOT / 'configs' / 'greeter.yaml'
EXAMPLES = ROOT / 'composer' / 'rules'

# A `sitecustomize` with which nothing of ROS can be imported, as if it were not installed.
WITHOUT_ROS = """
import sys
from importlib.abc import MetaPathFinder

class Refuse(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        top = name.partition('.')[0]
        if top in ('rclpy', 'rpyutils', 'builtin_interfaces', 'numpy') or top.endswith('_msgs') or (
            top.startswith(('rosidl', 'rcl_', 'ament'))
        ):
            print('IMPORTED', name, file=sys.stderr)
            raise ModuleNotFoundError(f'No module named {name!r}', name=name)

sys.meta_path.insert(0, Refuse())
"""


def start(command, folder=ROOT, **variables):
    """Run a command to its end, with Composer within reach."""
    return subprocess.run(
        command,
        cwd=folder,
        env=os.environ | {'PYTHONPATH': str(ROOT), **variables},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )


@pytest.fixture
def run(capsys):
    """Return exit code, standard output and standard error of a command."""

    def run(*arguments):
        code = cli.run([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run


# composer check


def test_a_right_file_is_ok(run):
    assert run('check', GREETER) == (0, f'{GREETER}: ok, 2 nodes\n', '')


def test_a_file_with_errors_fails_with_all_of_them(run):
    folder = EXAMPLES / 'bad-key'
    code, out, err = run('check', folder / 'bad.yaml')
    assert code == 1
    assert err == '2 errors in 1 file\n'
    expected = (folder / 'bad.txt').read_text()
    assert out.replace(f'{folder}/', '') == expected + '\n'


def test_a_check_imports_nothing_of_ros_and_only_what_the_file_needs():
    script = f"""{WITHOUT_ROS}
from composer.cli.main import run

code = run(['check', '-q', 'configs/greeter.yaml'])
print(code, *({{'asyncio', 'jinja2', 'jsonschema', 'rclpy', 'statistics'}} & {{*sys.modules}}))
run(['check', 'configs/parameter.yaml'])
"""
    done = start([sys.executable, '-c', script])
    assert done.stderr == ''
    assert done.stdout.startswith('0\nconfigs/parameter.yaml: ok, ')


def test_check_imports_no_behaviour(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path('noisy.py').write_text("open('ran', 'w')\nraise SystemExit(7)\ndef f(node): ...\n")
    Path('a.yaml').write_text('version: 1\nnodes: {a: {on_start: noisy:f}}\n')
    assert run('check', 'a.yaml') == (0, 'a.yaml: ok, 1 node\n', '')
    assert not Path('ran').exists()


def test_a_terminal_without_the_characters_gets_escapes(tmp_path):
    (tmp_path / 'a.yaml').write_text('version: 1\nnodes: {日本: {}}\n')
    command = [sys.executable, '-m', 'composer', 'check', 'a.yaml']
    result = start(command, tmp_path, PYTHONIOENCODING='latin-1')
    assert result.returncode == 1
    assert r"a.yaml:2:9: error[bad-name]: '\u65e5\u672c' cannot name a node" in result.stdout


def test_names_of_files_may_be_any_bytes(run):
    code, out, _ = run('check', b'caf\xe9.yaml'.decode(errors='surrogateescape'))
    assert code == 1
    assert r'caf\udce9.yaml: error[unreadable-file]: ' in out


# Exit codes


@pytest.mark.parametrize(
    'arguments',
    [
        ['chek'],
        ['check'],
        ['up'],
        ['up', 'a.yaml', '--log-level', 'talker:=loud'],
        ['up', 'a.yaml', '--set'],
        ['show', 'a.yaml', '--args', '--params'],
        ['show', 'a.yaml', '--origin', '--format', 'json'],
        ['graph', 'a.yaml', '--output', 'a.pdf'],
        ['check', 'a.yaml', '--ignore', 'bad-name', '--expect', 'bad-name'],
        ['interfaces', 'bild'],
        ['--nonsense'],
    ],
)
def test_wrong_usage_is_exit_code_2(run, arguments):
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ''
    assert re.fullmatch(r'error: [^\n]*[^\n.]\n  help: [^\n]*\n', err)


def test_a_wrong_level_says_the_right_ones(run):
    _, _, err = run('up', GREETER, '--log-level', 'loud')
    assert err == (
        "error: 'loud' is not a log level\n  help: use debug, info, warn, error or fatal, or NODE:=LEVEL\n"
    )


def test_a_wrong_option_says_the_nearest_right_one_and_where_the_others_stand(run):
    _, _, err = run('show', GREETER, '--orign')
    assert err.startswith("error: no such option '--orign'")
    assert "'--origin'" in err
    assert err.endswith("\n  help: 'composer show --help' shows the usage\n")


@pytest.mark.parametrize('command', ['show', 'graph'])
def test_a_negative_number_is_a_value_for_all_that_take_a_system(run, command):
    code, _, err = run(command, ROOT / 'configs' / 'add_two_ints_client.yaml', '-5', '3')
    assert (code, err) == (0, '')


def test_a_group_without_a_command_shows_what_it_has(run):
    code, out, err = run('interfaces')
    assert (code, out) == (2, '')
    assert err.startswith('Usage: composer interfaces ')


def test_the_help_of_each_command_fits_its_line(run):
    _, out, _ = run('--help')
    _, of_interfaces, _ = run('interfaces', '--help')
    assert '...\n' not in (out + of_interfaces).replace('COMMAND [ARGS]...\n', '')


@pytest.mark.parametrize('arguments', [['--help'], ['-h'], ['check', '--help'], ['up', '-h']])
def test_help_is_exit_code_0(run, arguments):
    code, out, err = run(*arguments)
    assert (code, err) == (0, '')
    assert out.startswith('Usage: composer')


def test_without_a_command_there_is_help(run):
    code, out, err = run()
    assert code == 2
    assert 'check' in out + err
    assert 'up' in out + err


def test_the_version_is_told(run):
    code, out, err = run('--version')
    assert (code, err) == (0, '')
    assert out.startswith('composer, version ')


def test_a_bug_is_exit_code_3_with_a_report(run, monkeypatch):
    def fail(path, **more):
        raise RuntimeError

    monkeypatch.setattr('composer.application.check.load_combinations', fail)
    code, out, err = run('check', GREETER)
    assert (code, out) == (3, '')
    lines = err.splitlines()
    assert lines[0] == (
        'This is a bug in Composer, not in your file. Please report it with the lines below.'
    )
    assert f"  arguments: ['check', '{GREETER}']" in lines
    assert lines[-1] == 'RuntimeError'


@pytest.mark.parametrize(
    ('raised', 'code', 'said'),
    [
        (ComposerError('it broke', help='mend it'), 1, 'error: it broke\n  help: mend it\n'),
        (ComposerError('it broke'), 1, 'error: it broke\n'),
        (UsageError('not so', help='but so'), 2, 'error: not so\n  help: but so\n'),
        (KeyboardInterrupt(), 130, '\n'),
    ],
)
def test_what_is_raised_on_purpose_becomes_an_exit_code(run, monkeypatch, raised, code, said):
    def fail(path, **more):
        raise raised

    monkeypatch.setattr('composer.application.check.load_combinations', fail)
    assert run('check', GREETER) == (code, '', said)


# --ros-args


@pytest.mark.parametrize(
    ('arguments', 'own', 'ros'),
    [
        ([], [], []),
        (['up', 'a'], ['up', 'a'], []),
        (['up', 'a', '--ros-args'], ['up', 'a'], []),
        (['up', 'a', '--ros-args', '-r', 'b:=c'], ['up', 'a'], ['-r', 'b:=c']),
        (['up', '--ros-args', '-p', 'b:=1', '--', 'a'], ['up', 'a'], ['-p', 'b:=1']),
        (['--ros-args', '-r', 'a:=b', '--', 'up', '--ros-args', '-r', 'c:=d', '--', 'x'],
         ['up', 'x'], ['-r', 'a:=b', '-r', 'c:=d']),
        (['--ros-args', '--ros-args', '-r', 'a:=b'], [], ['-r', 'a:=b']),
        (['up', '--', 'a'], ['up', '--', 'a'], []),
        (['--ros-args', '-r', 'a:=b', '--', '--', 'x'], ['--', 'x'], ['-r', 'a:=b']),
        (['up', '--log-level', 'debug', '--ros-args', '--log-level', 'info'],
         ['up', '--log-level', 'debug'], ['--log-level', 'info']),
    ],
)  # fmt: skip
def test_ros_arguments_are_taken_out(arguments, own, ros):
    assert cli.split_ros_arguments(arguments) == (own, ros)


# What somebody who comes from other tools writes


PYTHON = 'def generate_launch_description():\n    return LaunchDescription([])\n'
HABITS = [
    *((f'{word} FILE', "Did you mean 'up'?") for word in ('launch', 'run')),
    ('kill FILE', "Did you mean 'down'?"),
    ('start r.yaml', "help: 'composer up r.yaml' runs its system"),
    ('import FILE --force', "no such option '--force'"),
    ('import x.launch.py sim=true', 'help: write sim:=true'),
    ('up FILE sim=true', "write 'sim:=true'"),
    ('up FILE --sim true', "help: write 'sim:=true'"),
    ('up FILE --sim=true', "help: write 'sim:=true'"),
    ('check FILE --sim', "help: write 'sim:=VALUE'"),
    *((f'up r.launch.{end}', f"help: 'composer import r.launch.{end}'")
      for end in ('py', 'xml', 'yaml')),
    ('check includes.yaml', "help: 'composer import r.launch.yaml'"),
]  # fmt: skip


@pytest.mark.parametrize(('words', 'said'), HABITS, ids=[words for words, _ in HABITS])
def test_what_other_tools_take_is_an_error_with_what_to_write(
    run, tmp_path, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    for name, text in {
        'r.launch.py': PYTHON,
        'r.launch.xml': '<?xml version="1.0"?>\n<launch><arg name="a" default="1"/></launch>\n',
        'r.launch.yaml': 'launch:\n- node: {pkg: demo, exec: talker}\n',
        'includes.yaml': 'version: 1\ninclude: {r: {file: r.launch.yaml}}\n',
        'FILE': 'version: 1\nargs: {sim: false}\nnodes: {}\n',
    }.items():
        Path(name).write_text(text)
    code, out, err = run(*words.split())
    assert code in (1, 2)
    assert said in out + err


def test_o_is_output_in_every_command():
    options = {
        name: option.opts
        for name, command in cli.cli.commands.items()
        for option in command.params
        if '--output' in option.opts
    }
    assert len(options) > 5
    assert {name for name, opts in options.items() if '-o' not in opts} == set()
