"""A behaviour that breaks what all share: the log says which one ran, and the system ends."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import builtins
import os

def close_all(node):
    os.closerange(3, 4096)

def close_streams_too(node):
    os.closerange(0, 4096)

def replace_builtin(node):
    builtins.len = None

def exit(node):
    os._exit(7)

def crash(node):
    import ctypes
    ctypes.string_at(0)

def stop(node):
    node.logger.info(f'stopped, {len("abc")}')

def nothing(node):
    pass
"""
SYSTEM = """
version: 1
executor: {{shutdown_timeout: 5.0}}
nodes:
  bad: {{timers: {{hurt: {{period: 0.2, behaviour: {}}}}}}}
  good: {{on_stop: 'parts:stop', timers: {{tick: {{period: 3600, behaviour: 'parts:nothing'}}}}}}
"""


@pytest.mark.parametrize('behaviour', ["'parts:close_all'", "'parts:replace_builtin'"])
def test_the_system_ends_and_names_the_behaviours_that_ran_last(compose, behaviour):
    compose.may_lose_threads = True
    child = compose(SYSTEM.format(behaviour), CODE)

    assert child.wait() == 1
    report = next(n for n, line in enumerate(child.lines) if 'the system is broken' in line)
    assert "  node 'bad': timer 'hurt', " in child.lines[report + 1]
    assert child.matching('[good]: stopped, 3')


def test_the_guardian_tells_where_the_process_cannot(compose):
    child = compose("version: 1\nnodes: {n: {on_stop: 'parts:close_streams_too'}}\n", CODE)
    child.wait_until_ready()

    assert child.stop() == 1
    told = child.wait_for_line('descriptors')
    assert 'closed descriptors' in told or 'closed all descriptors' in told


def test_a_process_that_ends_without_a_stop_is_reported(compose):
    child = compose(SYSTEM.format('parts:exit'), CODE)

    assert child.wait() == 7
    child.wait_for_line('[FATAL] [composer]: the process ended without a stop')


def test_a_crash_shows_where_it_was(compose):
    child = compose(SYSTEM.format('parts:crash'), CODE)

    assert child.wait() < 0
    child.wait_for_line('in crash')
    child.wait_for_line('[FATAL] [composer]: the process ended without a stop')
