"""What ROS reads once in a process is refused while the system runs."""

import pytest

pytest.importorskip('rclpy')

from composer.cli.main import run

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
environment: {MODE: first}
nodes:
  talker:
    timers: {say: {period: 0.1, behaviour: parts:say}}
"""
CODE = """\
import os

def say(node):
    node.logger.info(f"{os.environ['MODE']} said")
"""
REFUSED = (
    'not reloaded: environment.MODE cannot change while the system runs: '
    'ROS reads this when it starts; this needs a restart: composer down, then composer up'
)


@pytest.fixture
def edit(compose):
    def change(old, new, name='system.yaml'):
        path = compose.folder / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    return change


def test_a_new_environment_is_refused_until_a_restart(compose, edit, capfd, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', str(compose.folder / 'log'))
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_for_line('first said')
    edit('MODE: first', 'MODE: second')
    assert child.wait_for_line('not reloaded: ').endswith(REFUSED)
    child.wait_for_line('first said', times=len(child.matching('first said')) + 3)
    assert run(['plan', str(compose.folder / 'system.yaml')]) == 0
    assert REFUSED.rpartition('; ')[2] in capfd.readouterr().out
    assert run(['reload']) == 1
    assert capfd.readouterr().err == f'system: {REFUSED}\n'

    # Once it is taken back, other edits are taken.
    edit('MODE: second', 'MODE: first')
    child.wait_for_line('the files have no errors any more')
    edit('period: 0.1', 'period: 0.2')
    assert child.wait_for_line('reloaded in').endswith(': ~1 timer')
    edit('MODE: first', 'MODE: second')
    assert run(['down']) == 0
    assert child.wait() == 0
    assert not child.matching('second said')
    child = compose((compose.folder / 'system.yaml').read_text(), CODE)
    child.wait_for_line('second said')
    assert child.stop() == 0


def test_interface_packages_come_and_their_changes_are_refused(
    compose, edit, shared_cache, monkeypatch
):
    monkeypatch.setenv('XDG_CACHE_HOME', str(shared_cache))
    definition = compose.folder / 'defs' / 'msg' / 'Spot.msg'
    definition.parent.mkdir(parents=True)
    definition.write_text('int32 x\n')
    child = compose(
        'version: 1\nnodes:\n  one: {}\n',
        'def say(node):\n'
        '    from new_defs.msg import Spot\n'
        '    node.logger.info(f"fields {list(Spot.get_fields_and_field_types())}")\n',
        '--watch',
    )
    child.wait_until_ready()
    edit(
        'nodes:\n',
        'interfaces: {new_defs: defs}\nnodes:\n'
        '  spots:\n'
        '    publishers: {spot: {type: new_defs/msg/Spot, external: true}}\n'
        '    timers: {say: {period: 0.1, behaviour: parts:say}}\n',
    )
    child.wait_for_line("fields ['x']")
    assert child.matching('reloaded in')[0].endswith(': +1 node')

    definition.write_text('int32 x\nint 32\n')
    child.wait_for_line('not reloaded')
    definition.write_text('int32 x\nfloat64 y\n')
    child.wait_for_line('interfaces.new_defs cannot change while the system runs')
    child.wait_for_line("fields ['x']", times=len(child.matching('fields')) + 2)
    assert child.stop() == 0
