"""The stubs of systems are valid, and say what the systems declare."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from composer.checks.checker import create_context
from composer.cli import main as cli
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.stubs.system_stubs import stand_ins, stubs_of

ROOT = Path(__file__).resolve().parent.parent.parent
SYSTEMS = [ROOT / 'configs/robot.yaml', ROOT / 'tests/data/valid/everything.yaml']

pytestmark = pytest.mark.ros

SETTINGS = """\
[mypy]
mypy_path = typings
strict = True
no_site_packages = True
ignore_missing_imports = True
warn_unused_ignores = False
"""
USES = """\
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseStamped, PoseWithCovariance, Twist, Vector3

if TYPE_CHECKING:
    from composer_stubs.payloads import geometry_msgs as payloads
    from composer_stubs.system import Follower, LeftWheel, RightWheel, Rover


def tick(node: 'Rover') -> 'payloads.Twist':
    node.publish('status', 'on')
    node.publish('cmd_vel', Twist(linear=Vector3(x=1)))  # error
    node.publish('cmd_vel', {'linear': {'x': node.parameters.speed}})
    node.publish('statsu', 'on')  # error
    node.publish('status', 1)  # error
    node.call('light', True).message.upper()
    node.call('light', True).messge  # error
    node.call('lihgt')  # error
    node.send_goal('drive')  # error
    node.parameters['frame.id'].upper()
    node.parameters['frame']  # error
    node.parameters.sped  # error
    node.state.count += 1
    node.state.cuont  # error
    node.logger.warnning('x')  # error
    node.logger.info('x', once=True)
    message = PoseStamped()
    message.header.stamp = node.now().to_msg()
    message.header.stamp = node.now()  # error
    (node.now() - node.now()).seconds  # error
    node.create_publisher('std_msgs/String', 'made')
    node.create_publisher('std_msgs/msg/String', 'made', 'sensor_date')  # error
    node.set_parameters('rover', {'speed': 2.0})
    node.parameters.speed = 2.0  # error
    node.parameters.mode == 'hard'  # error
    node.parameters.limit + 1  # error
    if node.parameters.limit is not None:
        node.parameters.limit + 1
    node.state.count.upper()  # error
    return {'linear': {'x': 1}}


def turn(node: 'LeftWheel | RightWheel') -> None:
    node.logger.info(node.name)
    node.publish('status', '')  # error


def look(node: 'Follower') -> None:
    node.state.place.pose  # error
    if node.state.place is not None and node.state.stamp is not None:
        node.state.place.pose.position
        node.state.place.position  # error
        node.now() - node.state.stamp  # error


pose = PoseWithCovariance()
pose.covariance = [0.0] * 36
pose.covariance[0] = 1
pose.covariance = 'none'  # error
pose.pose.position.x = 1  # error
pose.pose.position.x = 1.0
pose.pose.position.x = 'left'  # error
pose.pose.positon  # error
Twist(linaer=Vector3())  # error
"""


def stubs_in(path):
    return stubs_of(create_context(load_system(path), InterfaceCatalogue()))


def write(folder, files):
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


@pytest.mark.long
def test_mypy_finds_no_error_in_the_stubs_of_systems_and_those_of_uses(tmp_path):
    # In place of the package itself, which mypy takes a minute to read.
    files = stand_ins()
    for path in [*SYSTEMS, ROOT / 'tests' / 'data' / 'typed' / 'system.yaml']:
        for name, text in stubs_in(path).items():
            ast.parse(text, name)
            files[name] = text
    write(tmp_path / 'typings', files)
    (tmp_path / 'uses.py').write_text(USES)
    (tmp_path / 'mypy.ini').write_text(SETTINGS)
    everything = [str(path) for path in (tmp_path / 'typings').rglob('*.py*')]
    result = subprocess.run(
        [sys.executable, '-m', 'mypy', 'uses.py', *everything, '--explicit-package-bases'],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    found = [line for line in result.stdout.splitlines() if ': error: ' in line]
    wanted = {n for n, line in enumerate(USES.splitlines(), 1) if line.endswith('# error')}
    assert {int(line.split(':')[1]) for line in found if line.startswith('uses.py')} == wanted
    assert [line for line in found if not line.startswith('uses.py')] == []


def test_nodes_that_declare_the_same_have_one_class():
    text = stubs_in(ROOT / 'configs' / 'robot.yaml')['composer_stubs/robot.py']
    assert 'class FrontLeftWheel(_Node):' in text
    assert 'FrontRightWheel = FrontLeftWheel' in text


def test_constants_and_parts_of_interfaces_are_there():
    files = stubs_in(ROOT / 'configs' / 'fibonacci_server.yaml')
    action = next(text for name, text in files.items() if name.endswith('/action/__init__.pyi'))
    for line in (
        '    Goal: _TypeAlias = Fibonacci_Goal',
        '    Feedback: _TypeAlias = Fibonacci_Feedback',
        '    Impl: _Any',
    ):
        assert line in action.splitlines()
    files = stubs_in(ROOT / 'tests' / 'data' / 'typed' / 'system.yaml')
    text = files['sensor_msgs/msg/__init__.pyi']
    assert '    POWER_SUPPLY_STATUS_UNKNOWN: _ClassVar[int]' in text.splitlines()


def test_the_state_has_the_types_of_what_behaviours_store():
    text = stubs_in(ROOT / 'tests/data/typed/system.yaml')['composer_stubs/system.py']
    _, _, rest = text.partition('class FollowerState:')
    for line in (
        '    place: _geometry_msgs_msg.PoseWithCovariance | None',
        '    stamp: _builtin_interfaces_msg.Time | None',
        '    started: _rclpy_time.Time | None',
        '    mixed: _Any',
    ):
        assert line in rest.partition('class Follower(')[0].splitlines()


def test_the_command_writes_them_into_typings(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'my-robot.yaml').write_text('version: 1\nnodes: {rover: {on_start: go:go}}\n')
    assert cli.run(['stubs', 'my-robot.yaml']) == 0
    assert capsys.readouterr().out == 'typings: composer_stubs.my_robot\n'
    text = (tmp_path / 'typings' / 'composer_stubs' / 'my_robot.py').read_text()
    assert 'class Rover(_Node):' in text
    (tmp_path / 'other').mkdir()
    (tmp_path / 'other' / 'my-robot.yaml').write_text((tmp_path / 'my-robot.yaml').read_text())
    assert cli.run(['stubs', 'my-robot.yaml', 'other']) == 1
    assert "would both be 'composer_stubs.my_robot'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ('words', 'names'),
    [
        (['robot.yaml'], {'Small'}),
        (['robot.yaml', 'site.yaml'], {'Small', 'Added'}),
        (['robot.yaml', 'name:=large'], {'Large'}),
        (['robot.yaml', 'site.yaml', 'large'], {'Large', 'Added'}),
        (['robot.yaml', '--set', 'args.name=large'], {'Large'}),
    ],
)
def test_the_nodes_are_those_that_the_command_line_gives(tmp_path, monkeypatch, words, names):
    monkeypatch.chdir(tmp_path)
    text = 'version: 1\nargs: {name: small}\nnodes: {"{{ name }}": {on_start: go:go}}\n'
    (tmp_path / 'robot.yaml').write_text(text)
    (tmp_path / 'site.yaml').write_text('nodes: {added: {on_start: go:go}}\n')
    assert cli.run(['stubs', *words]) == 0
    text = (tmp_path / 'typings' / 'composer_stubs' / 'robot.py').read_text()
    known = {'Small', 'Large', 'Added'}
    assert {each for each in known if each in text} == names


def test_a_system_with_errors_has_no_stubs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'robot.yaml').write_text('version: 1\nnods: {}\n')
    assert cli.run(['stubs', 'robot.yaml']) == 1
    assert 'error[unknown-key]' in capsys.readouterr().err
    assert not (tmp_path / 'typings').exists()
