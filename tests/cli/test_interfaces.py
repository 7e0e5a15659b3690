"""`composer interfaces`: build, list and show interface packages."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.ament import INTERFACE_INDEX, PACKAGE_INDEX
from composer.cli import main as cli

pytestmark = pytest.mark.ros

ROOT = Path(__file__).resolve().parents[2]

DIAGNOSTIC_STATUS = """\
# diagnostic_msgs/msg/DiagnosticStatus
# This message holds the status of an individual component of the robot.
# Possible levels of operations.
byte OK=0
byte WARN=1
byte ERROR=2
byte STALE=3
# Level of operation enumerated above.
byte level
# A description of the test/component reporting.
string name
# A description of the status.
string message
# A hardware unique string.
string hardware_id
# An array of values associated with the status.
diagnostic_msgs/msg/KeyValue[] values
"""


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Return exit code, standard output and standard error of a command in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))

    def run(*arguments):
        code = cli.run(list(map(str, arguments)))
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def test_show_prints_fields_types_constants_and_comments(run):
    name = 'diagnostic_msgs/msg/DiagnosticStatus'
    assert run('interfaces', 'show', name) == (0, DIAGNOSTIC_STATUS, '')


def test_show_prints_the_three_parts_of_an_action(run):
    pytest.importorskip('test_msgs')
    expected = (
        '# test_msgs/action/Fibonacci\n'
        '# goal definition\nint32 order\n---\n'
        '# result definition\nint32[] sequence\n---\n'
        '# feedback\nint32[] sequence\n'
    )
    assert run('interfaces', 'show', 'test_msgs/action/Fibonacci') == (0, expected, '')


@pytest.mark.parametrize(
    ('name', 'advice'),
    [
        ('std_msgs/msg/Heder', "did you mean 'std_msgs/msg/Header'?"),
        ('std_msgs/Header', "did you mean 'std_msgs/msg/Header'?"),
        (
            'std_msgs',
            "'std_msgs' is a package: 'composer interfaces list std_msgs' shows its interfaces",
        ),
        ('std_msgs/msg/Qqqqqq', "'composer interfaces list std_msgs' shows its interfaces"),
        ('nope', "'composer interfaces list' shows all"),
    ],
)
def test_show_says_what_an_unknown_name_may_have_been_meant_to_be(run, name, advice):
    message = f"error: no package that is installed or built has an interface '{name}'\n  help: {advice}\n"
    assert run('interfaces', 'show', name) == (1, '', message)


def test_list_prints_what_is_installed(run):
    code, out, err = run('interfaces', 'list')
    assert (code, err) == (0, '')
    names = out.splitlines()
    assert {'std_msgs/msg/Header', 'std_srvs/srv/SetBool'} <= set(names)
    assert len(names) == len(set(names))


def test_list_prints_what_one_package_has(run):
    expected = 'std_srvs/srv/Empty\nstd_srvs/srv/SetBool\nstd_srvs/srv/Trigger\n'
    assert run('interfaces', 'list', 'std_srvs') == (0, expected, '')


def test_list_of_an_unknown_package_suggests_another(run):
    message = (
        "error: no interface package 'std_mgs' is installed or built\n"
        "  help: did you mean 'std_msgs'?\n"
    )
    assert run('interfaces', 'list', 'std_mgs') == (1, '', message)


BUILT = ['action_tutorials_interfaces', 'example_interfaces']
FIBONACCI = ROOT / 'configs/fibonacci_client.yaml'
SELF_CONTAINED = ROOT / 'configs/self_contained.yaml'


@pytest.fixture
def home(run, interface_cache, monkeypatch, tmp_path):
    """Return a cache, at an odd path, with the packages of two shipped systems alone."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(interface_cache))
    _, out, _ = run('interfaces', 'path', SELF_CONTAINED, FIBONACCI)
    home = tmp_path / 'a "b" $HOME `c`; é \\ \\\' d'
    for prefix in map(Path, out.splitlines()):
        shutil.copytree(prefix, home / 'composer/interfaces' / prefix.name)
    monkeypatch.setenv('XDG_CACHE_HOME', str(home))
    return home


def test_build_of_what_was_built_before_says_that_it_is_ready(run, home):
    assert run('interfaces', 'build', SELF_CONTAINED, FIBONACCI, SELF_CONTAINED) == (
        0,
        'example_interfaces: ready\naction_tutorials_interfaces: ready\n',
        '',
    )


def test_path_prints_where_the_packages_of_files_are_or_all(run, home):
    for files in ([SELF_CONTAINED, FIBONACCI], []):
        code, out, err = run('interfaces', 'path', *files)
        assert (code, err) == (0, '')
        prefixes = sorted(map(Path, out.splitlines()))
        assert [each.name.rpartition('-')[0] for each in prefixes] == BUILT
        for prefix, package in zip(prefixes, BUILT, strict=True):
            for file in ('package.xml', 'action/Fibonacci.action', 'action/Fibonacci.idl'):
                assert (prefix / 'share' / package / file).is_file()
            for index in (PACKAGE_INDEX, INTERFACE_INDEX):
                assert (prefix / index / package).is_file()


def test_list_and_show_know_what_was_built(run, home):
    expected = 'example_interfaces/srv/AddTwoInts\nexample_interfaces/action/Fibonacci\n'
    assert run('interfaces', 'list', 'example_interfaces') == (0, expected, '')
    name = 'example_interfaces/srv/AddTwoInts'
    expected = f'# {name}\n# Two summands.\nint64 a\nint64 b\n---\n# Their sum.\nint64 sum\n'
    assert run('interfaces', 'show', name) == (0, expected, '')


FIND = """
import os
from ament_index_python.packages import get_package_share_directory
from action_tutorials_interfaces.action import Fibonacci
print(get_package_share_directory('action_tutorials_interfaces'))
print(os.environ['LD_LIBRARY_PATH'].split(':')[0])
print(os.environ['PYTHONPATH'].split(':')[1])
"""
SHELLS = [each for each in ('sh', 'bash', 'zsh', 'fish') if shutil.which(each)]


@pytest.mark.parametrize('shell', SHELLS)
def test_a_shell_can_find_what_was_built(home, shell):
    option = 'fish' if shell == 'fish' else 'sh'
    command = f'"$PYTHON" -m composer interfaces env --shell {option} {FIBONACCI}'
    command = f'{command} | source' if shell == 'fish' else f'eval "$({command})"'
    variables = {'XDG_CACHE_HOME': str(home), 'PYTHON': sys.executable, 'PYTHONPATH': str(ROOT)}
    result = subprocess.run(
        [shutil.which(shell), '-c', f'{command}; "$PYTHON" -c "$FIND"'],
        env=os.environ | variables | {'FIND': FIND},
        capture_output=True,
        text=True,
        check=False,
    )
    [prefix] = (home / 'composer/interfaces').glob('action_tutorials_interfaces-*')
    assert (result.stdout.splitlines(), result.stderr) == (
        [
            f'{prefix}/share/action_tutorials_interfaces',
            f'{prefix}/lib',
            str(ROOT),
        ],
        '',
    )


def test_env_of_files_without_packages_is_empty(run):
    for arguments in ([], [ROOT / 'configs/greeter.yaml']):
        code, out, _ = run('interfaces', 'env', *arguments)
        assert (code, out) == (0, '')


def test_env_of_files_with_different_packages_of_one_name_is_refused(run):
    write_system('int32 x\n')
    Path('other/msg').mkdir(parents=True)
    Path('other/msg/Thing.msg').write_text('int32 y\n')
    Path('other.yaml').write_text(SYSTEM.replace('defs}', 'other}'))
    message = (
        "error: the files declare different packages 'my_defs'\n"
        '  help: name only one of these files\n'
    )
    for command in ('path', 'env'):
        assert run('interfaces', command, 'system.yaml', 'other.yaml') == (1, '', message)


def test_build_of_a_file_without_packages_says_so(run):
    path = ROOT / 'configs' / 'greeter.yaml'
    assert run('interfaces', 'build', path) == (0, '', f'{path} declares no interfaces\n')


def test_build_of_an_unreadable_file_says_why(run):
    code, out, err = run('interfaces', 'build', 'nowhere.yaml')
    assert (code, out) == (1, '')
    assert err.startswith('nowhere.yaml: error[unreadable-file]: cannot read the file: ')


SYSTEM = """\
version: 1
interfaces: {my_defs: defs}
nodes:
  a:
    publishers: {p: {type: my_defs/msg/Thing, external: true}}
    timers: {t: {period: 1, publish: p, message: {x: 1}}}
"""

TYPO = """\
defs/msg/Thing.msg:2:1: error[unknown-type]: there is no type 'strin'
  2 | strin name
    | ^^^^^
  help: did you mean 'string'?

"""


def write_system(definition, system=SYSTEM):
    folder = Path('defs/msg')
    folder.mkdir(parents=True)
    (folder / 'Thing.msg').write_text(definition)
    Path('system.yaml').write_text(system)


@pytest.mark.parametrize('command', [['check'], ['up'], ['interfaces', 'build']])
def test_a_typo_in_a_definition_is_shown_where_it_is_and_alone(run, command):
    write_system('int32 x\nstrin name\n')
    code, out, err = run(*command, 'system.yaml')
    assert code == 1
    shown = out if command == ['check'] else err
    assert shown == TYPO


def test_a_folder_that_is_not_there_is_said_once(run):
    Path('system.yaml').write_text(SYSTEM)
    code, _, err = run('interfaces', 'build', 'system.yaml')
    assert code == 1
    assert err == (
        "system.yaml:2:23: error[unknown-interfaces]: there is no folder 'defs' "
        "with the definitions of 'my_defs'\n"
        '  2 | interfaces: {my_defs: defs}\n'
        '    |                       ^^^^\n'
        '\n'
    )


def test_check_holds_fields_against_definitions_without_building_them(run, monkeypatch, tmp_path):
    cache = tmp_path / 'cache'
    monkeypatch.setenv('XDG_CACHE_HOME', str(cache))
    write_system('int32 x\nfloat64 y\n', SYSTEM.replace('{x: 1}', '{x: 1.5, z: 2}'))
    code, out, _ = run('check', 'system.yaml')
    assert code == 1
    assert 'system.yaml:6:54: error[field-type]: my_defs/msg/Thing: x: expected int32' in out
    assert 'system.yaml:6:59: error[unknown-field]: my_defs/msg/Thing has no field' in out
    assert not cache.exists()


def test_a_wrong_interfaces_block_is_not_no_interfaces(run):
    Path('system.yaml').write_text('version: 1\ninterfaces: {my_defs: 3}\nnodes: {}\n')
    code, out, err = run('interfaces', 'build', 'system.yaml')
    assert (code, out) == (1, '')
    assert err.startswith(
        'system.yaml:2:23: error[wrong-type]: expected a string or a mapping, got 3\n'
    )
