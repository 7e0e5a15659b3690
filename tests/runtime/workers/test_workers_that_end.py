"""A worker that dies takes its own nodes with it, and nothing else; nothing outlives a system."""

import os
import signal
import time

import pytest

pytest.importorskip('rclpy')

from tests.running import wait_for
from tests.runtime.workers.observed import (
    CODE,
    HEARS,
    TALKS,
    descendants,
    is_there,
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
SIGNALS = [signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM]


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
    assert child.stop() == 0


@pytest.mark.parametrize(
    ('rules', 'line', 'code'),
    [
        ('restart: {when: never}', "worker 'left' was ended by SIGKILL", None),
        (
            'restart: {when: never}, required: true',
            "worker 'left' is required: the system ends",
            1,
        ),
    ],
)
def test_a_worker_that_is_not_started_again(compose, rules, line, code):
    child = compose(system(NODES, f'workers: {{left: {{{rules}}}}}\n'), CODE)
    child.wait_until_ready()
    os.kill(pid_of(child, 'talker'), signal.SIGKILL)
    child.wait_for_line(line)
    if code is None:
        assert is_there(pid_of(child, 'far'))
        assert child.stop() == 0
    else:
        assert child.wait() == code
    assert child.matching('far ends in')
    assert child.matching('home ends in')


def test_whichever_process_is_killed_nothing_is_left(compose):
    child = compose(system(NODES), CODE)
    child.wait_until_ready()
    count = len([child.pid, *descendants(child.pid)])
    child.stop()
    for index in range(count):
        child = compose(system(NODES), CODE)
        child.wait_until_ready()
        everyone = [child.pid, *sorted(descendants(child.pid))]
        os.kill(everyone[index], signal.SIGKILL)
        if index:
            child.send(signal.SIGINT)
        wait_until_gone(everyone)


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
    assert child.matching("worker 'left' did not end within")
    wait_until_gone(everyone)


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
