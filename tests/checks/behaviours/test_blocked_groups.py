"""Behaviours that wait for ever, or for long, and those that only look like it."""

from textwrap import indent

import pytest

SYSTEM = """
  rover:
    state: {ready: false, items: [], event: later}
    subscriptions:
      go: {type: std_msgs/msg/Empty, behaviour: parts:go, external: true}
    timers:
      tick: {period: 1, behaviour: parts:tick}
"""
HEAD = """
import queue
import threading
import time
from queue import Queue
from threading import Event, Thread

GO, LATER, BY_HAND = Event(), Event(), threading.Event()
JOBS, LAST = queue.Queue(), queue.LifoQueue()
CAME = threading.Condition()
LOCK, AGAIN = threading.Lock(), threading.RLock()
READY = False


class Gate:
    def __init__(self):
        self.opened = Event()

    def open(self):
        self.opened.set()

    def wait(self):
        self.opened.wait()


GATE = Gate()


def wait_until(condition, pause=0.1):
    while not condition():
        time.sleep(pause)


def add(node):
    with LOCK:
        node.state.items.append(1)


def go(node, message):
    global READY
    READY = True
    node.state.ready = True
    GO.set()
    GATE.open()
    JOBS.put(1)
    LAST.put(1)
    with CAME:
        CAME.notify_all()
    node.state.event.set()
    Thread(target=BY_HAND.set).start()
"""
# By the rule: what each is in line with.
WRONG = {
    'GO.wait()': 'blocked-group',
    'GO.clear(); GO.wait()': 'blocked-group',
    'GATE.wait()': 'blocked-group',
    'node.state.event.wait()': 'blocked-group',
    'job = JOBS.get()': 'blocked-group',
    'with CAME: CAME.wait()': 'blocked-group',
    'while not node.state.ready: time.sleep(0.1)': 'blocked-group',
    'while True:\n    if node.state.ready: break\n    time.sleep(0.1)': 'blocked-group',
    'while not READY: time.sleep(0.1)': 'blocked-group',
    'with LOCK: add(node)': 'blocked-group',
    'with LOCK:\n    with LOCK: pass': 'blocked-group',
    'time.sleep(60)': 'long-sleep',
    'end = time.monotonic() + 30\nwhile time.monotonic() < end: pass': 'long-sleep',
}
RIGHT = [
    'GO.wait(0.5)',
    'if GO.is_set(): GO.wait()',
    'LATER.wait()',
    'BY_HAND.wait()',
    'GO.set(); GO.wait()',
    'if not JOBS.empty(): job = JOBS.get()',
    'job = JOBS.get(timeout=1)',
    'JOBS.put(1); job = JOBS.get()',
    'Thread(target=GO.wait).start()',
    't = Thread(target=GO.wait); t.start(); t.join(1.0)',
    'while not node.state.ready and node.now().nanoseconds < 9: time.sleep(0.1)',
    'while not node.state.ready:\n    if GO.wait(1): return\n',
    'while not node.state.ready: node.state.ready = True',
    'for _ in range(9):\n    if node.state.ready: break\n    time.sleep(0.1)',
    'with AGAIN:\n    with AGAIN: pass',
    'with LOCK: Thread(target=add, args=(node,)).start()',
    'if LOCK.acquire(blocking=False): LOCK.release()',
    'Thread(target=lambda: time.sleep(60)).start()',
    'end = time.monotonic() + 30\nwhile time.monotonic() < end:\n    if GO.wait(1): return',
]


def check_body(check, body, system=SYSTEM):
    code = f'{HEAD}\n\ndef tick(node):\n{indent(body, "    ")}\n'
    return check(system, code, installed=False)


@pytest.mark.parametrize(('body', 'rule'), WRONG.items(), ids=WRONG)
def test_a_behaviour_that_keeps_its_group_is_found(check, body, rule):
    assert {found for _, found in check_body(check, body)} == {rule}


@pytest.mark.parametrize('body', RIGHT)
def test_a_wait_that_ends_is_none(check, body):
    assert check_body(check, body) == []


@pytest.mark.parametrize('body', [each for each in WRONG if 'LOCK' not in each])
def test_in_a_group_of_its_own_a_behaviour_may_wait(check, body):
    alone = SYSTEM.replace('parts:tick', 'parts:tick, group: other').replace(
        'period: 1', 'period: 99'
    )
    assert check_body(check, body, alone) == []


@pytest.mark.parametrize('wait', ['GO.wait()', 'while not node.state.ready: time.sleep(0.1)'])
def test_on_start_waits_for_nothing_that_runs_after_it(check, wait):
    nodes = SYSTEM.replace('    timers:\n      tick: {period: 1, behaviour: parts:tick}\n', '')
    nodes += '    on_start: parts:tick\n'
    assert [rule for _, rule in check_body(check, wait, nodes)] == ['blocked-group']


@pytest.mark.parametrize('value', ['60', 'null'])
def test_who_says_that_a_behaviour_may_take_long_is_believed(check, value):
    nodes = SYSTEM.replace('period: 1', f'warn_after: {value}, period: 1')
    assert check_body(check, 'time.sleep(30)', nodes) == []
