"""Words of a command line that name files of ROS packages."""

from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from composer.ament import PACKAGE_INDEX
from composer.application.package_files import resolve_words
from composer.cli.commands import cli
from composer.cli.main import run
from composer.errors import ComposerError, UsageError

SYSTEM = 'version: 1\nnodes: {}\n'


@pytest.fixture
def share(tmp_path, monkeypatch):
    """Return the share folder of the package `arm`, which is installed; the test is elsewhere."""
    prefix = tmp_path / 'install'
    share = prefix / 'share' / 'arm'
    for name in ('systems/arm.yaml', 'systems/more.yml', 'test/arm.scenario.yaml', 'extra.yaml'):
        (share / name).parent.mkdir(parents=True, exist_ok=True)
        (share / name).write_text(SYSTEM)
    (share / 'launch').mkdir()
    (share / 'launch' / 'arm.launch.py').touch()
    (prefix / PACKAGE_INDEX).mkdir(parents=True)
    (prefix / PACKAGE_INDEX / 'arm').touch()
    (prefix / PACKAGE_INDEX / 'without').touch()
    # A folder in the working folder has the name of this one.
    (prefix / PACKAGE_INDEX / 'both').touch()
    (share.with_name('both') / 'systems').mkdir(parents=True)
    for name in ('extra.yaml', 'systems/local.yaml'):
        (share.with_name('both') / name).write_text(SYSTEM)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    (tmp_path / 'here' / 'both').mkdir(parents=True)
    (tmp_path / 'here' / 'folder').mkdir(parents=True)
    monkeypatch.chdir(tmp_path / 'here')
    Path('local.yaml').write_text(SYSTEM)
    return share


@pytest.mark.parametrize(
    ('words', 'expected'),
    [
        ('arm arm.yaml', '@/systems/arm.yaml'),
        ('arm more.yml rate:=5 x', '@/systems/more.yml rate:=5 x'),
        ('arm systems/arm.yaml', '@/systems/arm.yaml'),
        ('arm launch/arm.launch.py side:=left', '@/launch/arm.launch.py side:=left'),
        ('arm test/arm.scenario.yaml::case', '@/test/arm.scenario.yaml::case'),
        ('local.yaml arm more.yml', 'local.yaml @/systems/more.yml'),
        ('arm', '@/systems'),
        ('package://arm/systems/arm.yaml', '@/systems/arm.yaml'),
        # Values of arguments stay what they are.
        ('local.yaml arm', 'local.yaml arm'),
        ('local.yaml package://arm/meshes', 'local.yaml package://arm/meshes'),
        ('local.yaml arm other.yaml', 'local.yaml arm other.yaml'),
        # What is here is meant.
        ('folder local.yaml', 'folder local.yaml'),
        ('arm local.yaml', '@/systems local.yaml'),
        ('nothing local.yaml', 'nothing local.yaml'),
        ('without', 'without'),
        ('', ''),
    ],
)
def test_packages_are_found_and_all_else_is_left_alone(share, words, expected):
    given = words.split(' ') if words else []
    wanted = expected.replace('@/..', str(share.parent)).replace('@', str(share))
    assert ' '.join(resolve_words(given)) == wanted


@pytest.mark.parametrize(
    ('words', 'message', 'advice'),
    [
        ('ram arm.yaml', "no package 'ram' is installed", "did you mean 'arm'?"),
        (
            'arm amr.yaml',
            "package 'arm' has no file 'amr.yaml', in systems/ or beside it",
            "did you mean 'arm.yaml'?",
        ),
        (
            'without arm.yaml',
            "package 'without' has no file 'arm.yaml', in systems/ or beside it",
            '@ has no systems',
        ),
    ],
)
def test_what_is_not_there_is_said(share, words, message, advice):
    with pytest.raises(UsageError) as error:
        resolve_words(words.split())
    assert str(error.value) == message
    assert error.value.help == advice.replace('@', str(share.with_name('without')))


def test_a_package_that_is_not_installed_is_said(share):
    with pytest.raises(ComposerError, match="no package 'leg' is installed"):
        resolve_words(['package://leg/systems/leg.yaml'])


@pytest.mark.parametrize('links', ['manifest', 'egg link', 'all files'])
def test_of_a_linked_package_the_source_counts(share, tmp_path, links):
    source, build = tmp_path / 'src' / 'arm', tmp_path / 'build' / 'arm'
    (source / 'systems').mkdir(parents=True)
    (source / 'systems' / 'arm.yaml').write_text(SYSTEM)
    for name in ('package.xml', 'setup.py'):
        (source / name).touch()
    build.mkdir(parents=True)
    (build / 'setup.py').symlink_to(source / 'setup.py')
    if links == 'manifest':
        (share / 'package.xml').symlink_to(source / 'package.xml')
    elif links == 'egg link':
        packages = share.parents[1] / 'lib/python3.12/site-packages'
        packages.mkdir(parents=True)
        (packages / 'other.egg-link').write_text(f'{tmp_path}\n.')
        (packages / 'arm.egg-link').write_text(f'{build}\n.')
    else:
        (share / 'systems' / 'arm.yaml').unlink()
        (share / 'systems' / 'arm.yaml').symlink_to(source / 'systems' / 'arm.yaml')
    (path,) = resolve_words(['arm', 'arm.yaml'])
    assert Path(path).resolve() == source / 'systems' / 'arm.yaml'
    # What the build has made is only in the share folder.
    assert resolve_words(['arm', 'extra.yaml']) == [str(share / 'extra.yaml')]


def test_all_commands_take_a_package(share, capsys):
    (share / 'systems' / 'arm.yaml').write_text('version: 1\nnodes: {elbow: {}}\n')
    for command in ('check', 'show', 'graph'):
        assert run([command, 'arm', 'arm.yaml']) == 0, command
        assert 'elbow' in capsys.readouterr().out or command == 'check'
    assert run(['plan', 'arm', 'arm.yaml', 'arm', 'arm.yaml']) == 0
    assert run(['export', 'compose', 'arm', 'arm.yaml']) == 1
    assert 'is a file of an installed package' in capsys.readouterr().err
    assert run(['up', 'arm']) == 2
    assert f'{share}/systems/arm.yaml' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('words', 'incomplete', 'offered'),
    [
        (['up'], '', {'arm', 'folder/', 'local.yaml'}),
        (['up'], 'a', {'arm'}),
        (['plan', 'arm'], 'm', {'more.yml'}),
        (['test', 'arm'], '', {'arm.yaml', 'more.yml', 'folder/', 'local.yaml'}),
        (['check', 'without'], 'loc', {'loc'}),
    ],
)
def test_the_shell_completes_packages_and_their_systems(share, words, incomplete, offered):
    shell = ShellComplete(cli, {}, 'composer', '')
    items = shell.get_completions(words, incomplete)
    assert {item.value for item in items} >= offered
    assert all(item.value.startswith(incomplete) for item in items)
