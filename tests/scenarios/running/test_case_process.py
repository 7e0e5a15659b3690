"""The process of a case ends with a result, whatever happens in it."""

import os
import select
import signal
import subprocess
import sys

import pytest

from composer.scenarios.running.case_process import CaseProcess
from composer.scenarios.running.case_results import CaseResult
from tests.running import is_there

DEADLINE_SEC = 30


def run(function, limit_sec=DEADLINE_SEC):
    process = CaseProcess(lambda: function() or CaseResult(), limit_sec, captures=True)
    ready, _, _ = select.select([process.descriptor], [], [], DEADLINE_SEC)
    assert ready, 'it did not end'
    return process.end()


def failure_of(function, **options):
    (failure,) = run(function, **options).failures
    return failure


def segfault():
    import ctypes

    ctypes.string_at(0)


def loop():
    while True:
        pass


def hold_interpreter():
    """Block in C, with the lock of the interpreter."""
    import ctypes

    ctypes.PyDLL(None).sleep(DEADLINE_SEC)


def test_its_result_and_its_output_come_back():
    def speak():
        print('out')
        print('err', file=sys.stderr)
        subprocess.run(['echo', 'of a child'], check=True)
        return CaseResult(seed=5, notices=('a notice',))

    result = run(speak)
    assert (result.has_passed, result.seed, result.notices) == (True, 5, ('a notice',))
    assert (result.output, result.errors) == ('out\nof a child\n', 'err\n')
    assert 0 < result.real_sec < DEADLINE_SEC


@pytest.mark.parametrize(
    ('function', 'message'),
    [
        (segfault, 'its process was ended by SIGSEGV'),
        (lambda: os._exit(3), 'its process ended with exit code 3'),
        (lambda: os._exit(0), 'its process ended with exit code 0'),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), 'its process was ended by SIGKILL'),
        (lambda: sys.exit('enough'), 'its process ended with exit code 1'),
    ],
)
def test_a_process_that_dies_is_a_failure(function, message):
    failure = failure_of(function)
    assert (failure.kind, failure.message) == ('died', message)


def leave():
    os._exit(3)


def kill_itself():
    os.kill(os.getpid(), signal.SIGKILL)


def raise_a_signal():
    signal.raise_signal(signal.SIGTERM)


def become_another():
    os.execv('/bin/true', ['true'])


@pytest.mark.parametrize(
    'function', [segfault, leave, kill_itself, raise_a_signal, become_another]
)
def test_what_ends_its_process_is_shown(function):
    stack = failure_of(function).stack
    assert f'in {function.__name__}' in stack
    assert '/case_process.py' not in stack


@pytest.mark.parametrize('function', [loop, hold_interpreter])
def test_what_does_not_end_is_ended_and_shown(function):
    failure = failure_of(function, limit_sec=0.3)
    assert failure.kind == 'stuck'
    assert failure.message == 'it took longer than 0.3 s of real time'
    assert f'in {function.__name__}' in failure.stack


def test_what_it_has_started_ends_with_it(wait_for):
    def start():
        child = subprocess.Popen(['sleep', '1000'])
        return CaseResult(notices=(str(child.pid),))

    pid = int(run(start).notices[0])
    wait_for(lambda: not is_there(pid), 'the end of what it has started')
