"""`composer import --verify`: what processes are given is read as ROS reads it, and compared."""

import json
import os
import subprocess
import sys

import pytest

from composer.launch_files.verification.comparison import pair
from composer.launch_files.verification.given import read_given

FILES = {
    # As ROS reads it: keys are texts, and quotes make one of a number.
    'odd.yaml': "/**: {ros__parameters: {no: 1, on: {off: 1.0e-10}, q: '1e-10'}}",
    'own.yaml': '/**: {ros__parameters: {x: 1, y: 1}}',
    'node.yaml': '/left/drive: {ros__parameters: {gains: {p: 2}, x: 2}}\nother: {ros__parameters: {x: 9}}',
}


def given(*argv, **environment):
    return read_given(
        {'argv': ['/lib/arm/drive', *argv], 'env': environment, 'cwd': '/', 'files': FILES}, {}
    )


NAMED = ('--ros-args', '-r', '__node:=drive', '-r', '__ns:=/left')


@pytest.mark.parametrize(
    ('one', 'other'),
    [
        (('-a', *NAMED), ('-a', '--ros-args', '-r', '__ns:=left', '-r', '__node:=drive')),
        ((*NAMED, '-r', 'a:=b', '-r', 'c:=d'), (*NAMED, '-r', 'c:=d', '-r', 'a:=b', '-r', 'a:=e')),
        ((*NAMED, '-p', 'x:=1', '-p', 'y:=1'), (*NAMED, '--params-file', 'own.yaml')),
        (
            (*NAMED, '--params-file', 'own.yaml', '--params-file', 'node.yaml'),
            (*NAMED, '-p', 'x:=2', '-p', 'y:=1', '-p', 'gains.p:=2'),
        ),
        ((*NAMED, '--', '-b'), ('-b', *NAMED)),
        (
            (*NAMED, '--params-file', 'odd.yaml'),
            (*NAMED, '-p', 'no:=1', '-p', 'on.off:=1e-10\n...\n', '-p', "q:='1e-10'"),
        ),
    ],
)
def test_what_means_the_same_is_the_same(one, other):
    (found,) = pair([given(*one)], [given(*other)])
    assert found.is_same, list(found.difference())


def test_each_difference_is_told():
    (found,) = pair(
        [given('-a', *NAMED, '-p', 'x:=1', '-r', 'a:=b', LEVEL='1')],
        [given('-b', '--ros-args', '-r', '__node:=drive', '-p', 'x:=1.0', LEVEL='2')],
    )
    assert list(found.difference())[2:] == [
        "-arguments: ['-a']",
        "+arguments: ['-b']",
        '-namespace: /left',
        '-remap: a -> b',
        '-parameter: x = 1',
        '-environment: LEVEL=1',
        '+namespace: /',
        '+parameter: x = 1.0',
        '+environment: LEVEL=2',
    ]


def test_what_only_one_starts_is_told():
    (found,) = pair([], [given()])
    assert (found.label, list(found.difference())) == ('drive', ['only composer up starts it'])


@pytest.mark.ros
def test_a_stand_in_is_given_what_the_program_would_be(tmp_path, domain_id):
    path = tmp_path / 'system.yaml'
    path.write_text(
        'version: 1\nprocesses:\n  drive: {command: [sh, -x], name: drive, parameters: {x: 1}, '
        'env: {LEVEL: 3}, cwd: /}\n'
    )
    (tmp_path / 'written').mkdir()
    words = ['system', str(tmp_path / 'written'), 'sh', str(path)]
    subprocess.run(
        [sys.executable, '-m', 'composer.application.importing.stand_in_runs', *words],
        env=os.environ | {'ROS_DOMAIN_ID': str(domain_id)},
        check=True,
        capture_output=True,
        timeout=60,
    )
    (written,) = (tmp_path / 'written').glob('*.json')
    found = read_given(json.loads(written.read_text()), {})
    assert (found.program, found.arguments, found.name) == ('sh', ['-x'], 'drive')
    assert (found.parameters, found.environment['LEVEL'], found.folder) == ({'x': 1}, '3', '/')


LAUNCH_FILE = """
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, PushRosNamespace


def more(context):
    side = LaunchConfiguration('side').perform(context)
    return [Node(package='arm', executable='drive', name='more', arguments=[side + '!'])]


def generate_launch_description():
    side = LaunchConfiguration('side')
    node = Node(
        package='arm', executable='drive', name='drive', parameters=[{'side': side, 'n': '1'}],
        condition=IfCondition(LaunchConfiguration('sim')), remappings=[('a', ['/', side])],
    )
    return LaunchDescription([
        DeclareLaunchArgument('side', default_value='left', choices=['left', 'right']),
        DeclareLaunchArgument('sim', default_value='true'),
        GroupAction([PushRosNamespace(side), node]),
        OpaqueFunction(function=more),
    ])
"""


@pytest.mark.ros
def test_an_imported_launch_file_is_given_the_same(tmp_path, domain_id):
    """Needs the real `launch`, which is on no registry: it runs where ROS 2 is sourced."""
    pytest.importorskip('launch_ros')
    path = tmp_path / 'x.launch.py'
    path.write_text(LAUNCH_FILE)
    done = subprocess.run(
        [sys.executable, '-m', 'composer', 'import', '--verify', str(path), 'side:=right'],
        env=os.environ | {'ROS_DOMAIN_ID': str(domain_id)},
        check=False,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    # The function reads `side`, which is fixed: there is no other value to try.
    first, second, *others = done.stdout.splitlines()
    assert {first, second} == {'drive /right/drive: the same', 'drive /more: the same'}
    assert others == ['with sim:=false:', 'drive /more: the same']


def component(**keys):
    written = {'plugin': 'a::B', 'container': 'box', 'name': 'b', 'namespace': '', 'remaps': []}
    return read_given({**written, 'parameters': {}, 'extra': {}, **keys}, {})


@pytest.mark.parametrize(
    ('one', 'other', 'difference'),
    [
        ({'container': '/box', 'namespace': '/'}, {}, []),
        ({'name': '', 'extra': {'use_intra_process_comms': False}}, {'name': 'B'}, []),
        (
            {'parameters': {'x': 1, 'y.z': 'a'}, 'remaps': ['a:=b']},
            {'parameters': {'x': 2, 'y': {'z': 'a'}}, 'remaps': ['a:=b', 'a:=c']},
            ['-parameter: x = 1', '+parameter: x = 2'],
        ),
    ],
)
def test_components_are_compared_by_what_their_container_is_asked(one, other, difference):
    (found,) = pair([component(**one)], [component(**other)])
    assert list(found.difference())[2:] == difference
    assert found.is_same == (not difference)
