"""Launch files of processes: that they exist, and which arguments they take."""

import pytest

from composer.checks.checker import check_system
from composer.checks.launch_files import read_launch_arguments
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

FILES = {
    'one.launch.xml': '<launch><arg name="side"/><arg name="rate" default="1"/></launch>',
    'outer.launch.xml': '<launch><include file="one.launch.xml"><arg name="x"/></include></launch>',
    'broken.launch.xml': '<launch>',
    'one.launch.yaml': 'launch: [{arg: {name: side}}, {arg: {name: rate, default: 1}}]',
    'outer.launch.yaml': 'launch: [{include: {file: one.launch.yaml}}]',
    'one.launch.py': 'DeclareLaunchArgument("side")\nD.DeclareLaunchArgument(name="rate", '
    'default_value="1")\n',
    'loop.launch.py': 'for n in "ab":\n    DeclareLaunchArgument(n)\n',
    'other.py': 'LaunchDescription([])\n',
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with launch files, a package with another one, and a stand-in for ros2."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    (tmp_path / 'share/ament_index/resource_index/packages').mkdir(parents=True)
    (tmp_path / 'share/ament_index/resource_index/packages/arm').touch()
    (tmp_path / 'share/arm/launch').mkdir(parents=True)
    (tmp_path / 'share/arm/launch/arm.launch.xml').write_text(FILES['one.launch.xml'])
    (tmp_path / 'bin').mkdir()
    (tmp_path / 'bin/ros2').touch(mode=0o755)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    monkeypatch.setenv('PATH', str(tmp_path / 'bin'))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def find(folder, process):
    path = folder / 'system.yaml'
    path.write_text(f'version: 1\nnodes: {{other: {{}}}}\nprocesses:\n  nav: {process}\n')
    findings = check_system(load_system(path), InterfaceCatalogue())
    return [f'{finding.rule}: {finding.message}' for finding in findings]


@pytest.mark.parametrize(
    ('process', 'messages'),
    [
        ('{launch: one.launch.xml, arguments: {side: left}}', []),
        ('{launch: arm/launch/arm.launch.xml, arguments: {side: left}}', []),
        ('{launch: package://arm/launch/arm.launch.xml, arguments: {side: left}}', []),
        (
            '{launch: one.launch.py}',
            [
                "bad-launch-argument: 'one.launch.py' requires the argument 'side', which has no "
                'default value'
            ],
        ),
        (
            '{launch: one.launch.py, arguments: {side: left, rat: 2}}',
            ["bad-launch-argument: 'one.launch.py' declares no argument 'rat'"],
        ),
        (
            '{launch: two.launch.py}',
            ["missing-launch-file: there is no launch file 'two.launch.py'"],
        ),
        ('{launch: leg/leg.launch.py}', ["missing-package: no package 'leg' is installed"]),
        (
            '{launch: other.py, command: [sh]}',
            ["conflicting-keys: 'command' and 'launch' cannot be used together in process 'nav'"],
        ),
        (
            '{launch: other.py, arguments: [a]}',
            ['wrong-type: expected the arguments of the launch file by name, got a list'],
        ),
        (
            '{command: [sh], arguments: [a]}',
            [
                "conflicting-keys: 'command' and 'arguments' cannot be used together in process "
                "'nav'"
            ],
        ),
    ],
)
def test_what_is_said_of_a_launch_file(folder, process, messages):
    found = find(folder, process)
    assert [each for each in found if "'sh'" not in each] == messages


def test_of_two_programs_the_launch_file_is_the_one_too_many(folder):
    messages = find(folder, '{launch: other.py, package: arm, executable: drive}')
    assert messages
    assert all(each.startswith('conflicting-keys') for each in messages)


@pytest.mark.parametrize(
    ('name', 'arguments'),
    [
        ('one.launch.xml', ({'side', 'rate'}, {'side'})),
        ('one.launch.yaml', ({'side', 'rate'}, {'side'})),
        ('one.launch.py', ({'side', 'rate'}, {'side'})),
        ('outer.launch.xml', None),
        ('broken.launch.xml', None),
        ('loop.launch.py', None),
        ('none.launch.py', None),
    ],
)
def test_the_arguments_that_a_file_shows(folder, name, arguments):
    declared = read_launch_arguments(folder / name)
    assert (declared and (declared.names, declared.required)) == arguments
