"""Containers and nodes in C++, as their packages bring them: no stand-ins.

They need the packages `composition`, `demo_nodes_cpp`, `lifecycle` and `action_tutorials_cpp` in
the environment, from a sourced ROS 2 or an overlay that was built.
"""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from composer.ament import find_share

NEEDED = ('composition', 'demo_nodes_cpp', 'lifecycle', 'action_tutorials_cpp')
MISSING = [name for name in NEEDED if find_share(name) is None]
pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(bool(MISSING), reason=f'not in this environment: {", ".join(MISSING)}'),
]
CODE = """
import composer

def heard(node, message):
    node.logger.info(f'heard {message.data}')

def goals(node):
    goal = node.send_goal('fibonacci', {'order': 4})
    count = sum(1 for _ in goal.feedback)
    node.logger.info(f'{count} of feedback, {list(goal.result().sequence)}, {goal.status}')
    goal = node.send_goal('fibonacci', {'order': 40})
    next(goal.feedback)
    node.logger.info('a long one has begun')
    try:
        goal.result()
    except composer.ActionNotAvailableError as error:
        node.logger.info(f'{goal.status}: {error}')
    else:
        node.logger.info(f'the long one was {goal.status}')
"""
HEARS = {
    'hear': {
        'subscriptions': {
            'chatter': {
                'type': 'std_msgs/msg/String',
                'behaviour': 'parts:heard',
                'external': True,
            }
        }
    }
}
CONTAINERS = ('component_container', 'component_container_mt', 'component_container_isolated')


def talker(**keys):
    return {'package': 'composition', 'plugin': 'composition::Talker', **keys}


def listener(**keys):
    return {'package': 'composition', 'plugin': 'composition::Listener', **keys}


def system(components=None, kind=CONTAINERS[0], **keys):
    containers = {'c': {'executable': kind, 'restart': {'delay': 0}, 'components': components}}
    own = {'containers': containers} if components is not None else {}
    return json.dumps({'version': 1, 'diagnostics': False, 'nodes': {}, **own, **keys})


@pytest.fixture
def loaded(peer):
    """Return the full names of the nodes in the container, sorted."""
    from composition_interfaces.srv import ListNodes

    return lambda: sorted(peer.call(ListNodes, '/c/_container/list_nodes').full_node_names)


def ask(*words):
    command = [sys.executable, '-m', 'composer', *words]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@pytest.mark.parametrize('kind', CONTAINERS)
def test_components_run_whatever_the_container(compose, loaded, kind):
    components = {
        'talker': talker(intra_process=True),
        'listener': listener(intra_process=True, wait_for={'node': 'talker'}),
    }
    child = compose(system(components, kind, nodes=HEARS), CODE)
    child.wait_for_line('1 node, 2 components and 1 process ready in ')
    assert loaded() == ['/listener', '/talker']
    child.wait_for_line('[hear]: heard Hello World')
    child.wait_for_line('I heard: [Hello World')
    assert child.stop() == 0


def find_process(start, domain):
    """Return the one process of a domain whose name begins like this."""

    def is_it(pid):
        try:
            name = Path(f'/proc/{pid}/comm').read_text()
            environment = Path(f'/proc/{pid}/environ').read_bytes()
        except OSError:
            return False
        return name.startswith(start) and f'ROS_DOMAIN_ID={domain}\0'.encode() in environment

    (pid,) = filter(
        is_it, filter(str.isdecimal, (entry.name for entry in Path('/proc').iterdir()))
    )
    return int(pid)


@pytest.mark.parametrize('is_killed', [False, True])
def test_goals_of_a_server_end_also_when_it_is_killed(compose, is_killed):
    processes = {
        'counter': {'package': 'action_tutorials_cpp', 'executable': 'fibonacci_action_server'}
    }
    kind = 'action_tutorials_interfaces/action/Fibonacci'
    nodes = {
        'asks': {
            'action_clients': {'fibonacci': {'type': kind, 'external': True}},
            'timers': {'ask': {'period': 0.1, 'behaviour': 'parts:goals'}},
        }
    }
    child = compose(system(processes=processes, nodes=nodes), CODE)
    child.wait_for_line('3 of feedback, [0, 1, 1, 2, 3], succeeded')
    child.wait_for_line('a long one has begun')
    if is_killed:
        os.kill(find_process('fibonacci_actio', compose.domain_id), signal.SIGKILL)
        child.wait_for_line("unknown: the action server '/fibonacci' ended before the goal did")
    assert child.stop() == 0


def test_a_managed_program_is_driven_and_seen(compose):
    processes = {
        'lc': {
            'package': 'lifecycle',
            'executable': 'lifecycle_talker',
            'name': 'lc_talker',
            'lifecycle': 'active',
        }
    }
    child = compose(system(processes=processes, diagnostics={}))
    child.wait_for_line("'/lc_talker' is active")
    shown = json.loads(ask('top', '--once', '--format', 'json'))
    rows = {(each['node'], each['kind'], each['name']) for each in shown['entities']}
    assert ('/lc_talker', 'publisher', '/lifecycle_chatter') in rows
    assert child.stop() == 0
