"""Launch files that are checked, shown, compared and drawn without a system being written."""

import json

import pytest

from composer.cli.main import run
from composer.launch_files import importing
from composer.launch_files.description_reader import DescriptionReader
from composer.launch_files.place import Place
from composer.launch_files.results import Origin
from tests.launch_files import stand_ins as launch

# As far as launch is not here, its objects are these; the lines are those of this file.
FILE = """\
from launch import …


def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument('side', default_value='left'),
        Node(package='arm', executable='drive', name='driver', parameters=[{'side': side}]),
        Node(package='arm', executable='drive', name='driver', remappings=[('a b', 'c')]),
        Node(package='arm', executable='drive', name='last', parameters=['p.yaml', {'x': []}]),
    ])
"""
SIDE = launch.LaunchConfiguration('side')


@pytest.fixture
def given(tmp_path, monkeypatch):
    """A launch file, and the arguments that it was imported with."""
    path, given = tmp_path / 'x.launch.py', {}
    path.write_text(FILE)
    (tmp_path / 'p.yaml').write_text('lsat: {ros__parameters: {x: 1}}\n')
    monkeypatch.chdir(tmp_path)

    class Loader(launch.Loader):
        def origin_of(self, entity):
            return getattr(entity, 'origin', Origin())

    def at(line, entity):
        entity.origin = Origin(path, line)
        return entity

    def import_file(_path, words):
        given.update(words)
        parameters = [launch.ParameterFile('p.yaml'), {'x': []}]
        entities = [
            launch.DeclareLaunchArgument('side', 'left', '', ()),
            at(7, launch.Node('arm', 'drive', name='driver', parameters=[{'side': (SIDE,)}])),
            at(8, launch.Node('arm', 'drive', name='driver', remappings=[('a b', 'c')])),
            at(9, launch.Node('arm', 'drive', name='last', parameters=parameters)),
        ]
        place = Place(Loader(), dict(words))
        DescriptionReader(place).read([launch.LaunchDescription(entities)])
        return place.result

    monkeypatch.setattr(importing, 'import_file', import_file)
    return given


def test_findings_are_at_the_lines_of_actions(given, capsys):
    assert run(['check', '--format', 'json', 'x.launch.py', 'side:=right']) == 1
    report = json.loads(capsys.readouterr().out)
    found = {(each['rule'], each['file'], each['line']) for each in report['findings']}
    assert ('duplicate-node', 'x.launch.py', 8) in found
    assert ('bad-name', 'x.launch.py', 8) in found
    assert ('unmatched-node-name', 'p.yaml', 1) in found
    assert ('refused-parameter', 'x.launch.py', 9) in found
    assert {file for _, file, _ in found} == {'x.launch.py', 'p.yaml'}
    assert given == {'side': 'right'}


def test_what_would_be_started_is_shown_with_its_origin(given, capsys):
    assert run(['show', 'x.launch.py', '--origin']) == 0
    shown = capsys.readouterr().out
    assert 'side: left' in shown
    assert 'x.launch.py:7, side = left (default' in shown
    assert run(['graph', 'x.launch.py', '--format', 'json']) == 0
    assert 'driver' in capsys.readouterr().out


def test_two_launch_files_are_compared(given, tmp_path, capsys):
    (tmp_path / 'y.launch.py').write_text(FILE)
    run(['plan', 'x.launch.py', 'y.launch.py'])
    assert 'is no argument' not in capsys.readouterr().err


@pytest.mark.parametrize('words', [['--layer', 'p.yaml'], ['--set', 'nodes.a.rate=1']])
def test_what_is_for_systems_is_refused(given, words, capsys):
    assert run(['show', 'x.launch.py', *words]) == 2
    assert run(['check', 'x.launch.py', '--set', 'nodes.a.rate=1']) == 2
    assert 'composer import x.launch.py -o FILE' in capsys.readouterr().err


REAL = """
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([
        Node(package='no_such_package', executable='drive'),
    ])
"""
REAL_XML = '<launch>\n\n  <node pkg="no_such_package" exec="drive" />\n</launch>\n'


@pytest.mark.ros
@pytest.mark.parametrize(
    ('name', 'text', 'line'), [('r.launch.py', REAL, 8), ('r.launch.xml', REAL_XML, 3)]
)
def test_a_real_launch_file_is_checked(tmp_path, monkeypatch, capsys, name, text, line):
    """Needs the real `launch`, which is on no registry: it runs where ROS 2 is sourced."""
    pytest.importorskip('launch_ros')
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(text)
    assert run(['check', name]) == 1
    assert f'{name}:{line}:' in capsys.readouterr().out
