"""Edits of a node with a lifecycle: applied in whatever state it is, which it keeps."""

import json

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import GetState

from composer.cli.main import run
from tests.running import wait_for

pytestmark = pytest.mark.ros

CODE = """
def tick(node, text='tick'):
    node.logger.info(text)

def tell(node, text):
    node.logger.info(text)
"""
SYSTEM = """
version: 1
nodes:
  lidar:
    lifecycle: true
    timers: {tick: {period: 0.02, behaviour: 'parts:tick'}}
    on_activate: {behaviour: 'parts:tell', with: {text: activated}}
    on_deactivate: {behaviour: 'parts:tell', with: {text: deactivated}}
"""


def state_of(peer):
    return peer.call(GetState, 'lidar/get_state').current_state.label


def edit(compose, child, *replaced):
    path = compose.folder / 'system.yaml'
    text = path.read_text()
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new)
    reloads = len(child.matching('reloaded in'))
    path.write_text(text)
    child.wait_for_line('reloaded in', times=reloads + 1)


@pytest.fixture
def ask(capsys):
    def ask(*arguments):
        capsys.readouterr()
        assert run([*arguments, '--format', 'json']) == 0
        return json.loads(capsys.readouterr().out)

    return ask


def test_edits_are_applied_in_every_state_and_keep_it(compose, peer, ask):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    (system,) = ask('ps')['systems']
    assert system['lifecycles'] == {'/lidar': 'unconfigured'}
    peer.change_state('lidar', Transition.TRANSITION_CONFIGURE)
    rows = [each for each in ask('top', '--once')['entities'] if each['kind'] == 'lifecycle']
    assert [(each['node'], each['name']) for each in rows] == [('/lidar', 'inactive')]
    # While it rests: a timer that comes rests, too, and a behaviour is another one.
    edit(
        compose,
        child,
        (
            'timers: {',
            "timers: {other: {period: 0.02, behaviour: 'parts:tick', with: {text: tock}}, ",
        ),
        ('activated', 'up'),
    )
    assert not child.matching('[lidar]: t')
    peer.change_state('lidar', Transition.TRANSITION_ACTIVATE)
    assert child.matching('[lidar]: up')
    child.wait_for_line('[lidar]: tock', times=3)
    child.wait_for_line('[lidar]: tick', times=3)
    # Where it starts counts from the next start.
    edit(compose, child, ('lifecycle: true', 'lifecycle: {start: inactive}'))
    assert state_of(peer) == 'active'
    # One that is recreated comes back to its state.
    edit(compose, child, ('lifecycle: {', 'remap: {a: b}\n    lifecycle: {'))
    assert child.matching('[lidar]: deup')
    assert len(child.matching('[lidar]: up')) == 2
    assert state_of(peer) == 'active'
    ticks = len(child.matching('[lidar]: tick'))
    child.wait_for_line('[lidar]: tick', times=ticks + 3)
    # Without a lifecycle it works at once.
    edit(
        compose,
        child,
        ('    lifecycle: {start: inactive}\n', ''),
        ("    on_activate: {behaviour: 'parts:tell', with: {text: up}}\n", ''),
        ("    on_deactivate: {behaviour: 'parts:tell', with: {text: deup}}\n", ''),
    )
    ticks = len(child.matching('[lidar]: tick'))
    child.wait_for_line('[lidar]: tick', times=ticks + 3)
    assert child.stop() == 0


def test_an_edit_that_cannot_come_back_to_its_state_is_undone(compose, peer):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    peer.change_state('lidar', Transition.TRANSITION_CONFIGURE)
    peer.change_state('lidar', Transition.TRANSITION_ACTIVATE)
    path = compose.folder / 'system.yaml'
    text = path.read_text().replace('    lifecycle', '    remap: {a: b}\n    lifecycle')
    (compose.folder / 'parts.py').write_text(CODE + '\ndef refuse(node):\n    return False\n')
    path.write_text(
        text.replace("{behaviour: 'parts:tell', with: {text: activated}}", 'parts:refuse')
    )
    child.wait_for_line("node 'lidar': on_activate returned False")
    child.wait_for_line('[lidar]: activated', times=2)
    ticks = len(child.matching('[lidar]: tick'))
    wait_for(lambda: state_of(peer) == 'active', 'the state of before')
    child.wait_for_line('[lidar]: tick', times=ticks + 1)
    assert child.stop() == 0
