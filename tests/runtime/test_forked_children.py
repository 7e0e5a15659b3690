"""Behaviours that fork: the child never goes on as a second copy of the system."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import asyncio
import multiprocessing
import os
import signal
import sys
import threading
import time
from pathlib import Path

from rclpy.task import Future

def tell(name, text):
    with open(name, 'a') as file:
        file.write(f'{text}\\n')

def fork(name):
    child = os.fork()
    if child:
        _, status = os.waitpid(child, 0)
        tell(name, f'the child ended with {os.waitstatus_to_exitcode(status)}')
    return child == 0

def fork_and_return(node):
    print('from the child' if fork('fork_and_return') else 'from the parent')
    return 'child' if os.getpid() != node.state.pid else 'parent'

def fork_and_raise(node):
    if fork('fork_and_raise'):
        raise ValueError('in the child')

def fork_and_exit(node):
    if fork('fork_and_exit'):
        raise SystemExit(7)

def fork_and_yield(node):
    fork('fork_and_yield')
    yield None
    fork('fork_and_yield')
    yield None

async def fork_and_await(node):
    fork('fork_and_await')
    future = Future()
    threading.Timer(0.1, future.set_result, [None]).start()
    await future
    tell('fork_and_await', 'after the wait')
    return None

def run(name, method):
    context = multiprocessing.get_context(method)
    process = context.Process(target=tell, args=(name, 'in a process'))
    process.start()
    process.join()
    tell(name, f'the child ended with {process.exitcode}')

def run_process(node):
    run('run_process', 'fork')

def spawn_process(node):
    run('spawn_process', 'spawn')

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
    timers:
{timers}
  ticker:
    state: {{ticks: 0}}
    publishers: {{ticks: std_msgs/msg/Int32}}
    timers: {{tick: {{period: 0.01, behaviour: 'parts:tick', publish: ticks}}}}
  listener:
    state: {{heard: []}}
    subscriptions: {{ticks: {{type: std_msgs/msg/Int32, behaviour: 'parts:hear', qos: 1000}}}}
"""


# What each behaviour tells in a round.
ENDS = 'the child ended with '
TOLD = {
    'fork_and_return': [f'{ENDS}0'],
    'fork_and_raise': [f'{ENDS}1'],
    'fork_and_exit': [f'{ENDS}7'],
    'fork_and_yield': [f'{ENDS}0'],
    'fork_and_await': [f'{ENDS}0', 'after the wait'],
    'run_process': ['in a process', f'{ENDS}0'],
    'spawn_process': ['in a process', f'{ENDS}0'],
}


def test_the_children_of_behaviours_end_with_them_and_the_system_misses_nothing(compose, wait_for):
    timers = '\n'.join(
        f"      {name}: {{period: 0.1, behaviour: 'parts:{name}', publish: words}}"
        for name in TOLD
    )
    child = compose(SYSTEM.format(timers=timers), CODE)

    def told(name):
        path = compose.folder / name
        return path.read_text().splitlines() if path.exists() else []

    def have_all_told():
        return all(len(told(name)) >= 2 * len(lines) for name, lines in TOLD.items())

    wait_for(have_all_told, 'two rounds')
    child.wait_for_line(' in order', times=len(child.matching(' in order')) + 2)
    assert child.stop() == 0

    for name, lines in TOLD.items():
        assert told(name)[: 2 * len(lines)] == lines * 2, name
    assert not child.matching('AssertionError')
    assert len(child.matching(' in order')) == len(set(child.matching(' in order')))
    assert child.matching('from the child')
    assert child.matching('ValueError: in the child')
    assert not child.matching('raised ValueError')


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
    if not fork('fork_once'):
        print('after the fork')
        node.shutdown()
"""
    )
    child = compose(text, code)

    assert child.wait() == 0
    assert len(child.matching('before the fork')) == 1
    assert len(child.matching('after the fork')) == 1
