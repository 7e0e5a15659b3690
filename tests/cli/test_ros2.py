"""`ros2 composer` takes the words of `composer`, with the same results."""

import argparse
import subprocess
import sys
from importlib.metadata import entry_points

import pytest

from composer.cli.ros2 import ComposerCommand, complete_words
from tests.running import ROOT

GREETER = str(ROOT / 'configs' / 'greeter.yaml')


def parse(*words):
    """Parse words as ros2cli does: with a parser whose `--help` is its own, until it is told."""
    parser = argparse.ArgumentParser('ros2')
    command = parser.add_subparsers().add_parser('composer')
    ComposerCommand().add_arguments(command, 'ros2 composer')
    return parser.parse_args(['composer', *words]).words


@pytest.mark.parametrize(
    'words',
    [
        [],
        ['--help'],
        ['-h'],
        ['--version'],
        ['check', '--help'],
        ['up', 'a.yaml', 'rate:=-5', '-d', '--ros-args', '-r', 'a:=b', '--', '--set', 'x=1'],
        ['--', 'ps'],
        ['test', '-k', 'one or two', '-x'],
    ],
)
def test_all_words_are_composer_s(words):
    assert parse(*words) == words


@pytest.mark.parametrize(
    ('words', 'code', 'said'),
    [
        (['check', '-q', GREETER], 0, ''),
        (['check', '--strct', GREETER], 2, "no such option '--strct'"),
    ],
)
def test_it_ends_as_composer_does(words, code, said):
    program = (
        'import argparse, sys; from composer.cli.ros2 import ComposerCommand as Command;'
        'Command().main(parser=None, args=argparse.Namespace(words=sys.argv[1:]))'
    )
    done = subprocess.run(
        [sys.executable, '-c', program, *words], capture_output=True, text=True, check=False
    )
    own = subprocess.run(
        [sys.executable, '-m', 'composer', *words], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, own.stdout, own.stderr)
    assert said in own.stdout + own.stderr


def test_the_shell_completes_its_words():
    assert complete_words('che', argparse.Namespace(words=[])) == ['check']
    assert complete_words('--str', argparse.Namespace(words=['check'])) == [
        '--strict',
        '--strict-packages',
    ]


def test_the_shell_completes_files(tmp_path, monkeypatch):
    pytest.importorskip('argcomplete')
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'robot.yaml').touch()
    assert complete_words('rob', argparse.Namespace(words=['check'])) == ['robot.yaml']


def test_ros2cli_runs_it():
    pytest.importorskip('ros2cli')
    assert 'composer' in entry_points(group='ros2cli.command').names
    program = 'import sys; from ros2cli.cli import main; sys.exit(main())'
    done = subprocess.run(
        [sys.executable, '-c', program, 'composer', 'check', '--help'],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith('Usage: composer check ')
