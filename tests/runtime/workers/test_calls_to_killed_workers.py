"""Calls and goals that wait for a server end at once when its worker is killed."""

import os
import signal

import pytest

pytest.importorskip('rclpy')

from tests.runtime.workers.observed import CODE, node, pid_of, system

pytestmark = pytest.mark.ros

MORE = """
    def hang(node):
        print(f'{node.name} is asked', flush=True)
        time.sleep(3600)

    def serve(node, request):
        hang(node)
        return {'success': True}

    def run(node, goal):
        hang(node)
        return {'sequence': [1]}

    def tell(node, error):
        print(f'{node.name} has {type(error).__name__}: {error}', flush=True)

    def wait_for_response(node):
        try:
            node.call('set', True, timeout=None)
        except Exception as error:
            tell(node, error)

    async def await_response(node):
        try:
            await node.call_async('set', True, timeout=None)
        except Exception as error:
            tell(node, error)

    def wait_for_result(node):
        try:
            node.send_goal('run', {'order': 1}, timeout=None).result(timeout=None)
        except Exception as error:
            tell(node, error)
"""
CLIENTS = (
    'service_clients: {set: {type: std_srvs/srv/SetBool, service: set}}',
    'action_clients: {run: {type: test_msgs/action/Fibonacci, action: run}}',
)
SERVERS = (
    'services: {set: {type: std_srvs/srv/SetBool, behaviour: parts:serve, group: reentrant}}',
    'actions: {run: {type: test_msgs/action/Fibonacci, behaviour: parts:run}}',
)
NO_SERVICE = "ServiceNotAvailableError: the server of '/set' ended before it answered"
NO_ACTION = "ActionNotAvailableError: the action server '/run' ended before the goal did"


def waiter(worker, behaviour):
    """Return a node that waits for one answer."""
    client = CLIENTS['result' in behaviour]
    return node(worker, client, f'timers: {{t: {{period: 0.1, behaviour: parts:{behaviour}}}}}')


def test_what_waits_for_a_killed_server_has_an_error(compose):
    waiters = {
        'here': waiter('', 'wait_for_response'),
        'far': waiter('right', 'wait_for_response'),
        'awaits': waiter('right', 'await_response'),
        'goal_here': waiter('', 'wait_for_result'),
        'goal_far': waiter('right', 'wait_for_result'),
    }
    nodes = {'server': node('left', *SERVERS), **waiters}
    child = compose(system(nodes, 'workers: {left: {restart: {when: never}}}\n'), CODE + MORE)
    child.wait_until_ready()
    child.wait_for_line('server is asked', times=len(waiters))
    os.kill(pid_of(child, 'server'), signal.SIGKILL)
    for name in waiters:
        child.wait_for_line(f'{name} has {NO_ACTION if "goal" in name else NO_SERVICE}')
    assert child.stop() == 0
