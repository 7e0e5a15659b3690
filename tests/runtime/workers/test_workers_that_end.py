"""A worker that dies takes its own nodes with it, and nothing else; nothing outlives a system."""

import os
import signal

import pytest

pytest.importorskip('rclpy')

from tests.running import descendants, is_there
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


def test_a_worker_that_dies_is_started_again_and_the_others_run_on(compose):
    child = compose(
        system(
            NODES, 'workers: {left: {restart: {delay: 0.1}}, right: {restart: {delay: 0.1}}}\n'
        ),
        CODE,
    )
    child.wait_until_ready()
    far, home = pid_of(child, 'far'), pid_of(child, 'home')
    child.wait_for_line('far hears')
    for times, number in enumerate(SIGNALS, start=1):
        before = pid_of(child, 'talker', times=times)
        os.kill(before, number)
        again = pid_of(child, 'talker', times=times + 1)
        assert again != before
        child.wait_for_line("worker 'left' was started again, with its nodes", times=times)
        child.wait_for_line(f' of {again} in {far}')
        child.wait_for_line(f' of {again} in {home}')
        assert len(child.matching(f'talker ends in {before}')) == (number in STOPS)
        assert len(child.matching("left' has ended; its node is gone: '/talker'")) == times
        assert len(child.matching("'/far' gets nothing on '/numbers'")) == times
        assert len(child.matching("'/home' gets nothing on '/numbers'")) == times
    assert len(child.matching('far begins')) == len(child.matching('home begins')) == 1
    # One that only hears hears again.
    os.kill(far, signal.SIGKILL)
    child.wait_for_line(f' in {pid_of(child, "far", times=2)}', times=2)
    assert child.stop() == 0
    assert 'Traceback' not in child.output


LEAVE = """
    def leave(node):
        if os.path.exists('leave'):
            os._exit(0)
    """
LEAVER = '{worker: third, timers: {t: {period: 0.05, behaviour: parts:leave}}}'
REQUIRED = 'restart: {when: never}, required: true'


def test_a_worker_that_is_not_started_again(compose):
    rules = (
        'workers: {left: {restart: {when: never}}, third: {restart: {when: on_failure}}, '
        f'right: {{{REQUIRED}}}}}\n'
    )
    child = compose(system({**NODES, 'leaver': LEAVER}, rules), CODE + LEAVE)
    child.wait_until_ready()
    os.kill(pid_of(child, 'talker'), signal.SIGKILL)
    child.wait_for_line("worker 'left' was ended by SIGKILL")
    (compose.folder / 'leave').touch()
    child.wait_for_line("worker 'third' has ended with exit code 0")
    far = pid_of(child, 'far')
    assert is_there(far)
    os.kill(far, signal.SIGKILL)
    child.wait_for_line("worker 'right' is required: the system ends")
    assert child.wait() == 1
    assert child.matching('home ends in')
    assert not child.matching('was started again')


def test_a_required_worker_that_ends_well_ends_the_system_well(compose):
    nodes = {'home': node('', *HEARS), 'leaver': LEAVER}
    child = compose(system(nodes, f'workers: {{third: {{{REQUIRED}}}}}\n'), CODE + LEAVE)
    child.wait_until_ready()
    (compose.folder / 'leave').touch()
    child.wait_for_line("worker 'third' is required: the system ends")
    assert child.wait() == 0
    assert child.matching('home ends in')


def test_whichever_process_is_killed_nothing_is_left(compose):
    killed, everyone = 0, [0]
    while killed <= len(everyone):
        child = compose(system({'talker': node('left', *TALKS), 'home': node('', *HEARS)}), CODE)
        child.wait_until_ready()
        everyone = [child.pid, *sorted(descendants(child.pid))]
        worker = pid_of(child, 'talker')
        # At last all but the worker.
        left = [pid for pid in everyone if pid != worker]
        for pid in everyone[killed : killed + 1] or left:
            os.kill(pid, signal.SIGKILL)
        if 0 < killed < len(everyone):
            child.send(signal.SIGINT)
        wait_until_gone(everyone)
        killed += 1


def test_workers_that_hang_in_c_or_are_stopped_do_not_keep_the_system_from_its_end(compose):
    code = """
    import ctypes

    def hang(node):
        print(node.name, 'hangs', flush=True)
        ctypes.PyDLL(None).sleep(3600)
    """
    timer = 'timers: {t: {period: 0.1, behaviour: parts:hang}}'
    child = compose(
        system(
            {
                'bad': '{worker: left, ' + timer + '}',
                'far': node('right'),
                'home': node(''),
            },
            'executor: {shutdown_timeout: 1}\n',
        ),
        CODE + code,
    )
    child.wait_until_ready()
    child.wait_for_line('bad hangs')
    everyone = descendants(child.pid)
    os.kill(pid_of(child, 'far'), signal.SIGSTOP)
    assert child.stop() == 1
    assert child.matching('home ends in')
    assert child.matching("worker 'left' has not stopped in time")
    assert child.matching("worker 'right' has not stopped in time")
    assert not child.matching('far ends in')
    wait_until_gone(everyone)
