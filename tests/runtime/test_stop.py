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

def slow_end(node):
    try:
        while True:  # composer: ignore[endless-loop]
            node.logger.info('walking')
            yield
    finally:
        time.sleep(1000)

def fail(node):
    raise RuntimeError('out of order')

def stop(node):
    node.logger.info('stop')

def spin(node):
    node.logger.info('spinning')
    while True:  # composer: ignore[endless-loop]
        pass

def hold_interpreter(node):
    node.logger.info('holding')
    ctypes.PyDLL(None).sleep(1000)
"""


def system(*behaviours, fails=False, timeout=30.0):
    """Return a system with a node for each behaviour of a timer, with its name."""
    failing = "fail: {period: 0.3, behaviour: 'parts:fail', on_error: restart}" if fails else ''
    nodes = '\n'.join(
        f"""
          {behaviour}:
            on_stop: parts:stop
            timers:
              walk: {{period: 0.02, behaviour: 'parts:{behaviour}'}}
              {failing}
"""
        for behaviour in behaviours
    )
    return f"""
        version: 1
        executor: {{shutdown_timeout: {timeout}}}
        nodes:
{nodes}
    """


WALKERS = ('walk', 'walk_async')


def told_by(child, node):
    return [
        line.rpartition(': ')[2]
        for line in child.matching(f'[{node}]: ')
        if 'walking' not in line and 'timer' not in line
    ]


def test_generators_of_timers_are_closed_before_on_stop(compose):
    child = compose(system(*WALKERS), CODE)
    for node in WALKERS:
        child.wait_for_line(f'[{node}]: walking', times=2)
    assert child.stop() == 0

    for node in WALKERS:
        assert told_by(child, node) == ['closed', 'stop']
        assert child.matching(f'[{node}]: ')[-2:] == [
            f'[INFO] [{node}]: closed',
            f'[INFO] [{node}]: stop',
        ]


def test_generators_of_timers_are_closed_before_a_restart(compose):
    child = compose(system(*WALKERS, fails=True), CODE)
    for node in WALKERS:
        child.wait_for_line(f"node '{node}' was restarted", times=2)
    closed = {node: told_by(child, node) for node in WALKERS}
    child.stop()

    for node in WALKERS:
        assert closed[node][:4] == ['closed', 'stop', 'closed', 'stop']


def test_a_generator_that_does_not_let_itself_be_closed_is_an_error(compose):
    child = compose(system('stubborn'), CODE)
    child.wait_for_line('walking')
    assert child.stop() == 0

    assert child.matching("timer 'walk' (system.yaml:9) raised RuntimeError: generator ignored")
    assert child.lines[-1] == '[INFO] [stubborn]: stop'


def test_a_stop_ends_in_time_with_the_stacks_of_what_does_not(compose):
    child = compose(system('slow_end', 'spin', timeout=2.0), CODE)
    child.wait_for_line('walking')
    child.wait_for_line('spinning')

    assert child.stop() == 1
    for node, statement in (('slow_end', 'time.sleep(1000)'), ('spin', 'in spin')):
        child.wait_for_line(f"node '{node}': timer 'walk' did not end in time; it is at")
        assert child.matching(statement)


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
