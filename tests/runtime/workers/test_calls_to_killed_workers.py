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
        'awaits': waiter('right', 'await_response'),
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


ENDLESS = """
    import composer

    CALLS = {
        'ask': lambda node: node.call('set', True, timeout=None).message,
        'goal': lambda node: send(node).result(timeout=None).sequence[0],
        'read': lambda node: read(node),
    }

    def send(node):
        return node.send_goal('run', {'order': 1}, timeout=None)

    def read(node):
        return node.get_parameters('/server', ['pid'], timeout=None)['pid']

    def begin_to_serve(node):
        begin(node)
        node.ros.set_parameters([Parameter('pid', value=os.getpid())])

    def answer(node, request):
        return {'message': str(os.getpid())}

    def count(node, goal):
        yield {'sequence': [1]}
        return {'sequence': [os.getpid()]}

    def ask_for_ever(node, what):
        while True:
            try:
                print(f'{node.name} has {what} of {CALLS[what](node)}', flush=True)
            except (composer.CallError, composer.GoalError) as error:
                print(f'{node.name} has {type(error).__name__}', flush=True)
            # ROS keeps ten responses of a service, and loses those that come faster than these go.
            time.sleep(0.1)

    async def ask_for_ever_async(node, what):
        while True:
            try:
                response = await node.call_async('set', True, timeout=None)
                print(f'{node.name} has {what} of {response.message}', flush=True)
            except composer.CallError as error:
                print(f'{node.name} has {type(error).__name__}', flush=True)
            time.sleep(0.1)
"""
ASKS = [('', 'ask'), ('', 'goal'), ('right', 'await'), ('right', 'read')]


def asking(worker, what):
    """Return a node that asks again and again, each time until it has an answer."""
    behaviour = 'ask_for_ever_async' if what == 'await' else 'ask_for_ever'
    timer = f'{{period: 0.1, behaviour: "parts:{behaviour}", with: {{what: {what}}}}}'
    ends = *CLIENTS, f'timers: {{t: {timer}}}'
    return node(worker, 'warn_after: null', *ends)


def test_calls_that_begin_after_a_kill_reach_the_server_that_comes_back(compose):
    """The requests went to the killed one, which DDS lists for 20 s more."""
    server = (
        '{worker: left, on_start: {behaviour: parts:begin_to_serve}, parameters: {pid: 0}, '
        'services: {set: {type: std_srvs/srv/SetBool, behaviour: parts:answer}}, '
        'actions: {run: {type: test_msgs/action/Fibonacci, behaviour: parts:count}}}'
    )
    asks = {f'{what}_{worker or "here"}': asking(worker, what) for worker, what in ASKS}
    nodes = {'server': server, **asks}
    restart = 'workers: {left: {restart: {when: always, delay: 2}}}\n'
    imports = '    from rclpy.parameter import Parameter\n'
    child = compose(system(nodes, restart), CODE + imports + MORE + ENDLESS)
    child.wait_until_ready()
    for turn in (1, 2):
        pid = pid_of(child, 'server', times=turn)
        for name in asks:
            child.wait_for_line(f'{name} has {name.partition("_")[0]} of {pid}')
        if turn < 2:
            os.kill(pid, signal.SIGKILL)
    child.wait_for_line("[ask_here]: Waiting for service '/set'…")
    child.wait_for_line("[goal_here]: Waiting for action server '/run'…")
    child.wait_for_line("Waiting for the parameter services of node '/server'…")
    assert child.stop() == 0
