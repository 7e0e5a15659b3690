"""Suspended behaviours end at a stop and before a restart, and every stop comes to its end."""

import signal

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import ctypes
import time

def walk(node):
    try:
        while True:  # composer: ignore[endless-loop]
            node.logger.info('walking')
            yield
    finally:
        node.logger.info('closed')

async def walk_async(node):
    try:
        while True:  # composer: ignore[endless-loop]
            node.logger.info('walking')
            yield
    finally:
        node.logger.info('closed')

def stubborn(node):
    while True:  # composer: ignore[endless-loop]
        try:
            node.logger.info('walking')
            yield
        except GeneratorExit:
            pass

def fail(node):
    raise RuntimeError('out of order')

def ask(node):
    time.sleep(0.2)
    node.call('self')

def answer(node, request):
    return {'success': True}

def stop(node):
    node.logger.info('stop')

def hold_interpreter(node):
    node.logger.info('holding')
    ctypes.PyDLL(None).sleep(1000)
"""


WALKERS = ('walk', 'walk_async', 'stubborn')
WALKING = "walk: {{period: 0.02, behaviour: 'parts:{name}'}}"
FAILING = "fail: {period: 0.3, behaviour: 'parts:fail', on_error: restart}"


def told_by(child, node):
    return [
        line.rpartition(': ')[2]
        for line in child.matching(f'[{node}]: ')
        if 'walking' not in line and 'timer' not in line
    ]


def test_generators_of_timers_are_closed_before_on_stop_and_before_a_restart(compose):
    nodes = ''.join(
        f"""
  {name}:
    on_stop: parts:stop
    timers:
      {WALKING.format(name=name)}
      {FAILING if name == 'walk' else ''}
"""
        for name in WALKERS
    )
    child = compose(f'version: 1\nnodes:\n{nodes}', CODE)
    for name in ('walk_async', 'stubborn'):
        child.wait_for_line(f'[{name}]: walking', times=2)
    child.wait_for_line("node 'walk' was restarted", times=2)
    assert child.stop() == 0

    assert told_by(child, 'walk')[:4] == ['closed', 'stop', 'closed', 'stop']
    assert told_by(child, 'walk_async') == ['closed', 'stop']
    # One that does not let itself be closed is an error.
    assert child.matching(' raised RuntimeError: generator ignored')
    assert told_by(child, 'stubborn')[-1] == 'stop'


def test_a_restart_waits_for_calls_that_the_node_itself_answers(compose):
    text = f"""
        version: 1
        nodes:
          own:
            timers:
              ask: {{period: 0.1, behaviour: 'parts:ask', group: reentrant}}
              {FAILING}
            service_clients: {{self: {{type: std_srvs/srv/Trigger, service: answer}}}}
            services: {{answer: {{type: std_srvs/srv/Trigger, behaviour: 'parts:answer'}}}}
    """
    child = compose(text, CODE)
    child.wait_for_line("node 'own' was restarted", times=2)
    assert not child.matching('hangs')
    assert child.stop() == 0


def test_a_call_that_holds_the_interpreter_does_not_keep_a_stopping_process_alive(compose):
    text = """
        version: 1
        executor: {shutdown_timeout: 2.0}
        nodes: {stuck: {on_stop: 'parts:hold_interpreter'}}
    """
    hurry = """
from composer.runtime import stop

stop._MARGIN_SEC = 0.5
"""
    child = compose(text, CODE + hurry)
    child.wait_until_ready()

    assert child.stop() == -signal.SIGKILL
    assert child.matching('in hold_interpreter')


def test_a_process_leaves_the_graph_as_a_whole(compose, wait_for, peer):
    text = """
        version: 1
        defaults: {parameter_services: true}
        nodes:
          one: {on_stop: 'parts:stop'}
          two: {on_stop: 'parts:stop'}
    """
    tell = """
import rclpy.node

def destroy_node(self):
    print('destroyed', self.get_name(), flush=True)

rclpy.node.Node.destroy_node = destroy_node
"""
    child = compose(text, CODE + tell)
    child.wait_until_ready()
    wait_for(lambda: {'one', 'two'} <= set(peer.node.get_node_names()), 'the nodes')

    assert child.stop() == 0
    assert len(child.matching(': stop')) == 2
    assert not child.matching('destroyed one')
    wait_for(lambda: not {'one', 'two'} & set(peer.node.get_node_names()), 'their end')
    wait_for(lambda: not peer.node.count_services('/one/set_parameters'), 'the end of services')
