"""Suspended behaviours end at a stop and before a restart, and every stop comes to its end."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import ctypes
import time

def walk(node):
    try:
        while True:
            node.logger.info('walking')
            yield
    finally:
        node.logger.info('closed')

async def walk_async(node):
    try:
        while True:
            node.logger.info('walking')
            yield
    finally:
        node.logger.info('closed')

def stubborn(node):
    while True:
        try:
            node.logger.info('walking')
            yield
        except GeneratorExit:
            pass

def slow_end(node):
    try:
        while True:
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
    while True:
        pass

def hold_interpreter(node):
    node.logger.info('holding')
    ctypes.PyDLL(None).sleep(1000)
"""


def system(behaviour, *, fails=False, timeout=30.0):
    failing = "fail: {period: 0.3, behaviour: 'parts:fail', on_error: restart}" if fails else ''
    return f"""
        version: 1
        executor: {{shutdown_timeout: {timeout}}}
        nodes:
          walker:
            on_stop: parts:stop
            timers:
              walk: {{period: 0.02, behaviour: 'parts:{behaviour}'}}
              {failing}
    """


@pytest.mark.parametrize('behaviour', ['walk', 'walk_async'])
def test_generators_of_timers_are_closed_before_on_stop(compose, behaviour):
    child = compose(system(behaviour), CODE)
    child.wait_for_line('walking', times=2)
    assert child.stop() == 0

    assert child.lines[-2:] == ['[INFO] [walker]: closed', '[INFO] [walker]: stop']
    assert len(child.matching('closed')) == 1


@pytest.mark.parametrize('behaviour', ['walk', 'walk_async'])
def test_generators_of_timers_are_closed_before_a_restart(compose, behaviour):
    child = compose(system(behaviour, fails=True), CODE)
    child.wait_for_line("node 'walker' was restarted", times=2)
    closed = [
        line.rpartition(': ')[2]
        for line in child.matching('[walker]: ')
        if 'walking' not in line and 'timer' not in line
    ]
    child.stop()

    assert closed[:4] == ['closed', 'stop', 'closed', 'stop']


def test_a_generator_that_does_not_let_itself_be_closed_is_an_error(compose):
    child = compose(system('stubborn'), CODE)
    child.wait_for_line('walking')
    assert child.stop() == 0

    assert child.matching("timer 'walk' (system.yaml:8) raised RuntimeError: generator ignored")
    assert child.lines[-1] == '[INFO] [walker]: stop'


@pytest.mark.parametrize(
    ('behaviour', 'said', 'statement'),
    [('slow_end', 'walking', 'time.sleep(1000)'), ('spin', 'spinning', 'in spin')],
)
def test_a_stop_ends_in_time_with_the_stacks_of_what_does_not(compose, behaviour, said, statement):
    child = compose(system(behaviour, timeout=2.0), CODE)
    child.wait_for_line(said)

    assert child.stop() == 1
    child.wait_for_line("node 'walker': timer 'walk' did not end in time; it is at")
    assert child.matching(statement)


def test_a_call_that_holds_the_interpreter_does_not_keep_a_stopping_process_alive(compose):
    text = """
        version: 1
        executor: {shutdown_timeout: 2.0}
        nodes: {stuck: {on_stop: 'parts:hold_interpreter'}}
    """
    child = compose(text, CODE)
    child.wait_until_ready()

    assert child.stop() == 1
    assert child.matching('in hold_interpreter')
