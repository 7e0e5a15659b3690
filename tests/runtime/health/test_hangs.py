"""Behaviours that run for long: what is reported, and that nothing else is affected."""

import re

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import threading
import time
from pathlib import Path

from rclpy.task import Future

def wait_for(name):
    while not Path(name).exists():
        time.sleep(0.01)

def hang(node, *_):  # composer: ignore[field-type]
    wait_for('over')

def hang_inside(node):
    yield
    wait_for('over')

async def pause():
    future = Future()
    threading.Thread(target=lambda: (wait_for('over'), future.set_result(None))).start()
    await future

async def hang_async(node):
    await pause()

async def block_async(node):
    await block()

async def block():
    wait_for('over')

async def hang_async_generator(node):
    yield
    await pause()

def live(node):
    node.logger.info('alive')

def call(node):
    node.call('slow', timeout=1.0)

def count(node, goal):
    pauses = []
    begun = time.monotonic()
    for number in range(goal.order):
        time.sleep(0.12)
        before_yield = time.monotonic()
        yield [number]
        pauses.append(time.monotonic() - begun)
        begun = before_yield
    node.logger.info(f'counted, resting for {max(pauses):.3f} s at most')
    return [1]

def count_slowly(node, goal):
    yield [0]
    wait_for('over')
    yield [1]
    node.logger.info('counted')
    return [1]
"""

REPORT = re.compile(
    r'\[WARN\] \[bad\]: (.+) \(system.yaml:(\d+)\) has been running for (.+) s; it is at'
)


def stack_after(child, line):
    begin = child.lines.index(line) + 1
    end = next(
        (
            index
            for index, text in enumerate(child.lines[begin:], begin)
            if text.startswith('[') or not text.startswith(' ')
        ),
        len(child.lines),
    )
    return '\n'.join(child.lines[begin:end])


HANGING = {
    'hang': ['hang', 'wait_for'],
    'hang_inside': ['hang_inside', 'wait_for'],
    'hang_async': ['hang_async', 'pause'],
    'block_async': ['block_async', 'block', 'wait_for'],
    'hang_async_generator': ['hang_async_generator', 'pause'],
}


def test_a_behaviour_that_hangs_is_reported_once_with_its_stack_and_when_it_ends(compose):
    timers = '\n'.join(
        f"              {name}: {{period: 0.02, behaviour: 'parts:{name}', warn_after: 0.2, group: {name}}}"
        for name in HANGING
    )
    text = f"""
        version: 1
        executor: {{threads: 8}}
        nodes:
          bad:
            timers:
{timers}
          good:
            timers: {{live: {{period: 0.02, behaviour: 'parts:live'}}}}
    """
    child = compose(text, CODE)
    reports = {}
    for place, name in enumerate(HANGING, start=7):
        line = child.wait_for_line(f"timer '{name}' (system.yaml:{place}) has been running for")
        found = REPORT.fullmatch(line)
        assert found, line
        assert float(found[3]) >= 0.2
        reports[name] = line
    alive = len(child.matching('alive'))
    child.wait_for_line('alive', times=alive + 20)
    (compose.folder / 'over').touch()
    for place, name in enumerate(HANGING, start=7):
        timer = f"timer '{name}' (system.yaml:{place})"
        end = child.wait_for_line(f'{timer} returned after ')
        assert re.fullmatch(rf'\[WARN\] \[bad\]: {re.escape(timer)} returned after \d+\.\d s', end)
    child.stop()

    for name, functions in HANGING.items():
        lines = stack_after(child, reports[name]).splitlines()
        stack = [text for text in lines if text.startswith('    File')]
        assert [text.rpartition(' in ')[2] for text in stack if 'parts.py' in text] == functions
        assert 'composer/' not in stack[0]
    assert len(child.matching('has been running for')) == len(HANGING)


LIMITS = {('null', '0.1'): False, (None, 'null'): False, (None, None): True, ('0.1', 'null'): True}


def test_the_limit_of_an_entity_wins_over_those_of_the_node_and_of_the_file(compose):
    def key(value):
        return '' if value is None else f', warn_after: {value}'

    nodes = '\n'.join(
        f"""
          bad_{number}:
            timers: {{stuck: {{period: 0.02, behaviour: 'parts:hang'{key(own)}}}}}
            description: a node
            {key(node).removeprefix(', ')}
"""
        for number, (own, node) in enumerate(LIMITS)
    )
    text = f"""
        version: 1
        executor: {{threads: 8}}
        defaults: {{warn_after: 0.1}}
        nodes:
{nodes}
          witness:
            warn_after: 0.3
            timers: {{stuck: {{period: 0.02, behaviour: 'parts:hang'}}}}
    """
    child = compose(text, CODE)
    child.wait_for_line('[witness]: timer')
    for number, is_reported in enumerate(LIMITS.values()):
        if is_reported:
            child.wait_for_line(f"[bad_{number}]: timer 'stuck' (system.yaml:")
    (compose.folder / 'over').touch()
    child.wait_for_line('[witness]: timer', times=2)
    assert child.stop() == 0

    reports = child.matching('has been running for')
    for number, is_reported in enumerate(LIMITS.values()):
        assert any(f'[bad_{number}]: ' in line for line in reports) is is_reported


def test_what_is_slow_again_and_again_is_not_told_each_time(compose):
    text = """
        version: 1
        nodes:
          bad:
            warn_after: 0.05
            timers: {slow: {period: 0.01, behaviour: 'parts:slow'}}
    """
    code = """
        import time

        def slow(node):
            time.sleep(0.2)
            node.logger.info('done')
    """
    child = compose(text, code)
    child.wait_for_line('done', times=8)
    assert child.stop() == 0

    assert len(child.matching('has been running for')) == 1
    assert len(child.matching('returned after')) == 1


def test_a_service_that_hangs_is_reported_and_who_waits_for_its_answer(compose):
    text = """
        version: 1
        nodes:
          bad:
            service_clients: {slow: std_srvs/srv/Trigger}
            timers: {ask: {period: 0.02, behaviour: 'parts:call', warn_after: 0.1}}
            services:
              slow: {type: std_srvs/srv/Trigger, behaviour: 'parts:hang', warn_after: 0.1, group: own}
    """
    child = compose(text, CODE)
    owners = {
        "timer 'ask' (system.yaml:6)": 'in call',
        "service 'slow' (system.yaml:8)": 'in hang',
    }
    reports = {
        owner: child.wait_for_line(f'[bad]: {owner} has been running for') for owner in owners
    }
    (compose.folder / 'over').touch()
    for owner, function in owners.items():
        child.wait_for_line(f'[bad]: {owner} returned after')
        assert function in stack_after(child, reports[owner])


def test_hooks_of_a_node_that_hang_are_reported(compose):
    text = """
        version: 1
        nodes:
          bad:
            warn_after: 0.1
            on_start: parts:hang
            on_stop: parts:hang
    """
    child = compose(text, CODE)
    child.wait_for_line('[bad]: on_start (system.yaml:6) has been running for')
    (compose.folder / 'over').touch()
    child.wait_for_line('[bad]: on_start (system.yaml:6) returned after')
    child.wait_until_ready()
    (compose.folder / 'over').unlink()
    child.send(2)
    child.wait_for_line('[bad]: on_stop (system.yaml:7) has been running for')
    (compose.folder / 'over').touch()
    child.wait_for_line('[bad]: on_stop (system.yaml:7) returned after')


ACTION = """
version: 1
nodes:
  bad:
    actions:
      count: {{type: test_msgs/action/Fibonacci, behaviour: 'parts:{behaviour}', warn_after: 0.4}}
  client:
    action_clients: {{count: test_msgs/action/Fibonacci}}
    timers: {{go: {{period: 0.02, behaviour: 'parts:go'}}}}
"""

ACTION_CODE = (
    CODE
    + """
def go(node):
    yield
    node.send_goal('count', {'order': 8}, timeout=30)
    yield
    return None
"""
)


def test_an_action_that_yields_feedback_is_not_reported(compose):
    pytest.importorskip('test_msgs')
    text = ACTION.format(behaviour='count').replace('warn_after: 0.4', 'warn_after: 2.0')
    child = compose(text, ACTION_CODE.replace("'order': 8", "'order': 20"))
    line = child.wait_for_line('counted')
    assert child.stop() == 0

    # On a crowded machine it may have rested for too long indeed.
    rest_sec = float(line.split()[-4])
    assert rest_sec > 2.0 or not child.matching('has been running for')


def test_an_action_that_yields_no_more_is_reported_until_it_does(compose):
    pytest.importorskip('test_msgs')
    child = compose(ACTION.format(behaviour='count_slowly'), ACTION_CODE)
    line = child.wait_for_line("[bad]: action 'count' (system.yaml:6) has been running for")
    (compose.folder / 'over').touch()
    child.wait_for_line('counted')
    child.wait_for_line("[bad]: action 'count' (system.yaml:6) ")
    child.stop()

    assert 'in count_slowly' in stack_after(child, line)
