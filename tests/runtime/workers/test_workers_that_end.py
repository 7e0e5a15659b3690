"""A worker that dies takes its own nodes with it, and nothing else; nothing outlives a system."""

import os
import signal
import time

import pytest

pytest.importorskip('rclpy')

from tests.running import descendants, is_there, wait_for
from tests.runtime.workers.observed import (
    CODE,
    HEARS,
    TALKS,
    node,
    pid_of,
    system,
    wait_until_gone,
)

pytestmark = pytest.mark.ros

NODES = {
    'talker': node('left', *TALKS),
    'far': node('right', *HEARS),
    'home': node('', *HEARS),
}
# One whose signal asks for its end stops its nodes first.
STOPS = [signal.SIGTERM, signal.SIGINT]
SIGNALS = [signal.SIGKILL, signal.SIGTERM]


@pytest.mark.parametrize('number', SIGNALS, ids=lambda each: each.name)
def test_a_worker_that_dies_is_started_again_and_the_others_run_on(compose, number):
    child = compose(system(NODES, 'workers: {left: {restart: {delay: 0.1}}}\n'), CODE)
    child.wait_until_ready()
    before = {name: pid_of(child, name) for name in NODES}
    child.wait_for_line('far hears')
    os.kill(before['talker'], number)
    assert pid_of(child, 'talker', times=2) != before['talker']
    child.wait_for_line("worker 'left' was started again, with its nodes")
    again = pid_of(child, 'talker', times=2)
    child.wait_for_line(f' of {again} in {before["far"]}')
    assert len(child.matching('far begins')) == len(child.matching('home begins')) == 1
    assert child.matching("worker 'left' has ended; its node is gone: '/talker'")
    assert child.matching("'/far' gets nothing on '/numbers'")
    assert child.matching("'/home' gets nothing on '/numbers'")
    assert len(child.matching(f'talker ends in {before["talker"]}')) == (number in STOPS)
    assert child.stop() == 0
    assert 'Traceback' not in child.output


NEVER = 'restart: {when: never}'
REQUIRED = f'{NEVER}, required: true'
ENDS = "worker 'left' is required: the system ends"


@pytest.mark.parametrize(
    ('rules', 'how', 'line', 'code'),
    [
        (NEVER, 'SIGKILL', "worker 'left' was ended by SIGKILL", None),
        (REQUIRED, 'SIGKILL', ENDS, 1),
        ('restart: {when: on_failure}', 0, "worker 'left' has ended with exit code 0", None),
        (REQUIRED, 0, ENDS, 0),
    ],
)
def test_a_worker_that_is_not_started_again(compose, rules, how, line, code):
    leave = """
    def leave(node):
        if os.path.exists('leave'):
            os._exit(0)
    """
    leaver = '{worker: left, timers: {t: {period: 0.05, behaviour: parts:leave}}}'
    nodes = {**NODES, 'leaver': leaver}
    child = compose(system(nodes, f'workers: {{left: {{{rules}}}}}\n'), CODE + leave)
    child.wait_until_ready()
    if how == 0:
        (compose.folder / 'leave').touch()
    else:
        os.kill(pid_of(child, 'talker'), signal.Signals[how])
    child.wait_for_line(line)
    if code is None:
        assert is_there(pid_of(child, 'far'))
        assert child.stop() == 0
    else:
        assert child.wait() == code
    assert child.matching('far ends in')
    assert child.matching('home ends in')


def test_whichever_process_is_killed_nothing_is_left(compose):
    killed, everyone = 0, [0]
    while killed < len(everyone):
        child = compose(system(NODES), CODE)
        child.wait_until_ready()
        everyone = [child.pid, *sorted(descendants(child.pid))]
        os.kill(everyone[killed], signal.SIGKILL)
        if killed:
            child.send(signal.SIGINT)
        wait_until_gone(everyone)
        killed += 1


def test_all_processes_but_one_are_killed_and_nothing_is_left(compose):
    for index in range(3):
        child = compose(system(NODES), CODE)
        child.wait_until_ready()
        everyone = [child.pid, *sorted(descendants(child.pid))]
        left = (child.pid, pid_of(child, 'talker'), pid_of(child, 'far'))[index]
        for pid in everyone:
            if pid != left:
                os.kill(pid, signal.SIGKILL)
        wait_until_gone(everyone)


def test_a_worker_that_hangs_in_c_does_not_keep_the_system_from_its_end(compose):
    code = """
    import ctypes

    def hang(node):
        print(node.name, 'hangs', flush=True)
        ctypes.PyDLL(None).sleep(3600)
    """
    timer = 'timers: {t: {period: 0.1, behaviour: parts:hang}}'
    child = compose(
        system(
            {'bad': '{worker: left, ' + timer + '}', 'home': node('')},
            'executor: {shutdown_timeout: 1}\n',
        ),
        CODE + code,
    )
    child.wait_for_line('bad hangs')
    everyone = descendants(child.pid)
    assert child.stop() == 1
    assert child.matching('home ends in')
    assert child.matching("worker 'left' has not stopped in time")
    wait_until_gone(everyone)


def test_a_worker_that_was_stopped_is_killed_at_the_stop_of_the_system(compose):
    child = compose(system(NODES, 'executor: {shutdown_timeout: 1}\n'), CODE)
    child.wait_until_ready()
    everyone = descendants(child.pid)
    os.kill(pid_of(child, 'talker'), signal.SIGSTOP)
    assert child.stop() == 1
    assert child.matching("worker 'left' has not stopped in time")
    assert not child.matching('talker ends in')
    wait_until_gone(everyone)


def test_nodes_stop_once_though_a_signal_and_the_system_end_their_worker(compose):
    slow = """
    def end_slowly(node):
        end(node)
        time.sleep(0.5)
    """
    nodes = {**NODES, 'slow': '{worker: left, on_stop: parts:end_slowly}'}
    child = compose(system(nodes), CODE + slow)
    child.wait_until_ready()
    os.kill(pid_of(child, 'talker'), signal.SIGTERM)
    child.wait_for_line('slow ends in')
    assert child.stop() == 0, child.output
    assert len(child.matching('slow ends in')) == len(child.matching('talker ends in')) == 1


def test_a_worker_that_is_being_started_again_keeps_nobody_from_the_stop(compose):
    (compose.folder / 'slow.py').write_text("""
import os, time
if os.path.exists('slowly'):
    print('imports', flush=True)
    time.sleep(3600)
def begin(node):
    print(f'{node.name} begins in {os.getpid()}', flush=True)
""")
    nodes = {'bad': '{worker: left, on_start: slow:begin}', 'home': node('')}
    child = compose(system(nodes, 'workers: {left: {restart: {delay: 0}}}\n'), CODE)
    child.wait_until_ready()
    (compose.folder / 'slowly').touch()
    os.kill(pid_of(child, 'bad'), signal.SIGKILL)
    child.wait_for_line('imports')
    assert child.stop() == 0
    assert not child.matching('could not start again')


def test_workers_die_at_random_and_the_system_stays_whole(compose):
    child = compose(
        system(NODES, 'workers: {left: {restart: {delay: 0}}, right: {restart: {delay: 0}}}\n'),
        CODE,
    )
    child.wait_until_ready()
    for times in (2, 3):
        for name in ('talker', 'far'):
            os.kill(pid_of(child, name, times=times - 1), signal.SIGKILL)
            time.sleep(0.05)
        for name in ('talker', 'far'):
            pid_of(child, name, times=times)
    last = pid_of(child, 'talker', times=3)
    wait_for(lambda: child.matching(f'of {last} in {pid_of(child, "far", times=3)}'), 'messages')
    assert child.stop() == 0


@pytest.mark.parametrize(('where', 'code'), [('import', 1), ('on_start', 1)])
def test_a_worker_without_its_descriptors_ends(compose, where, code):
    spoil = 'os.closerange(3, 200)'
    text = system({'home': node(''), 'bad': '{worker: left, on_start: spoils:begin}'})
    lines = {'import': f'import os\n{spoil}\ndef begin(node): pass\n'}
    lines['on_start'] = f'import os\ndef begin(node): {spoil}\n'
    (compose.folder / 'spoils.py').write_text(lines[where])
    child = compose(text, CODE)
    assert child.wait() == code
    assert child.matching("worker 'left' has ended with exit code 1 while it started")
    assert not child.matching(' ready in ')
