"""Behaviours that fork: the child never goes on as a second copy of the system."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import asyncio
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from rclpy.task import Future

def tell(text):
    with open('told', 'a') as file:
        file.write(f'{text}\\n')

def fork():
    child = os.fork()
    if child:
        _, status = os.waitpid(child, 0)
        tell(f'the child ended with {os.waitstatus_to_exitcode(status)}')
    return child == 0

def fork_and_return(node):
    print('from the child' if fork() else 'from the parent')
    return 'child' if os.getpid() != node.state.pid else 'parent'

def fork_and_raise(node):
    if fork():
        raise ValueError('in the child')

def fork_and_exit(node):
    if fork():
        raise SystemExit(7)

def fork_and_exit_with_a_word(node):
    if fork():
        raise SystemExit('the child goes')

def fork_and_yield(node):
    fork()
    yield None
    fork()
    yield None

async def fork_and_await(node):
    fork()
    future = Future()
    threading.Timer(0.1, future.set_result, [None]).start()
    await future
    tell('after the wait')
    return None

def run_process(node, method):
    context = multiprocessing.get_context(method)
    process = context.Process(target=tell, args=('in a process',))
    process.start()
    process.join()
    tell(f'the child ended with {process.exitcode}')

def terminate(node):
    process = multiprocessing.get_context('fork').Process(target=time.sleep, args=(1000,))
    process.start()
    process.terminate()
    process.join()
    tell(f'the child ended with {process.exitcode}')

def run_program(node):
    code = subprocess.call([sys.executable, '-c', 'raise SystemExit(3)'])
    tell(f'the child ended with {code}')

def start(node):
    node.state.pid = os.getpid()

def tick(node):
    node.state.ticks += 1
    return node.state.ticks

def hear(node, message):
    node.state.heard.append(message.data)
    if len(node.state.heard) % 50 == 0:
        assert node.state.heard == list(range(1, len(node.state.heard) + 1))
        node.logger.info(f'{len(node.state.heard)} in order')
"""

SYSTEM = """
version: 1
nodes:
  forker:
    on_start: parts:start
    publishers: {{words: std_msgs/msg/String}}
    timers: {{fork: {{period: 0.1, behaviour: 'parts:{behaviour}', publish: words{arguments}}}}}
  ticker:
    state: {{ticks: 0}}
    publishers: {{ticks: std_msgs/msg/Int32}}
    timers: {{tick: {{period: 0.01, behaviour: 'parts:tick', publish: ticks}}}}
  listener:
    state: {{heard: []}}
    subscriptions: {{ticks: {{type: std_msgs/msg/Int32, behaviour: 'parts:hear', qos: 1000}}}}
"""


@pytest.mark.parametrize(
    ('behaviour', 'arguments', 'told'),
    [
        ('fork_and_return', '', ['the child ended with 0']),
        ('fork_and_raise', '', ['the child ended with 1']),
        ('fork_and_exit', '', ['the child ended with 7']),
        ('fork_and_exit_with_a_word', '', ['the child ended with 1']),
        ('fork_and_yield', '', ['the child ended with 0']),
        ('fork_and_await', '', ['the child ended with 0', 'after the wait']),
        ('run_process', ', with: {method: fork}', ['in a process', 'the child ended with 0']),
        ('run_process', ', with: {method: spawn}', ['in a process', 'the child ended with 0']),
        ('terminate', '', ['the child ended with -15']),
        ('run_program', '', ['the child ended with 3']),
    ],
)
def test_the_child_of_a_behaviour_ends_with_it_and_the_system_misses_nothing(
    compose, wait_for, behaviour, arguments, told
):
    # A timer is a generator of one value in one case, which publishes nothing.
    child = compose(SYSTEM.format(behaviour=behaviour, arguments=arguments), CODE)
    path = compose.folder / 'told'
    count = 2 * len(told)
    wait_for(lambda: path.exists() and len(path.read_text().splitlines()) >= count, 'two rounds')
    child.wait_for_line(' in order', times=len(child.matching(' in order')) + 2)
    assert child.stop() == 0

    lines = path.read_text().splitlines()
    assert lines[:count] == told * 2
    assert not child.matching('AssertionError')
    assert len(child.matching(' in order')) == len(set(child.matching(' in order')))
    if behaviour == 'fork_and_return':
        assert child.matching('from the child')
    if behaviour == 'fork_and_raise':
        assert child.matching('ValueError: in the child')
        assert not child.matching('raised ValueError')
    if behaviour == 'fork_and_exit_with_a_word':
        assert child.matching('the child goes')


def test_what_is_in_the_buffers_is_written_once(compose):
    text = """
        version: 1
        nodes: {forker: {timers: {fork: {period: 0.02, behaviour: 'parts:fork_once'}}}}
    """
    code = (
        CODE
        + """
def fork_once(node):
    sys.stdout = open(sys.stdout.fileno(), 'w', buffering=10000, closefd=False)
    print('before the fork')
    if not fork():
        print('after the fork')
        node.shutdown()
"""
    )
    child = compose(text, code)

    assert child.wait() == 0
    assert len(child.matching('before the fork')) == 1
    assert len(child.matching('after the fork')) == 1
