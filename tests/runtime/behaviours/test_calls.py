"""Calls of behaviours, and which of them run."""

import threading
import time

import pytest

pytest.importorskip('rclpy')

from composer.runtime.behaviours.calls import FAILED, BehaviourCall
from composer.runtime.behaviours.running_calls import Owner, RunningCalls


def call_of(function, running, deliver=lambda _: None, failed=lambda owner, error: None):
    return BehaviourCall(Owner('timer', 'tick'), function, running, deliver=deliver, failed=failed)


def test_a_running_call_tells_its_thread_its_begin_and_its_stack():
    running = RunningCalls()
    seen = []
    before = time.monotonic_ns()

    def look_around():
        (call,) = running.calls()
        seen.append((call, call.format_stack()))

    assert call_of(look_around, running).run() is not FAILED
    ((call, stack),) = seen
    assert (call.owner, call.thread) == (Owner('timer', 'tick'), threading.get_ident())
    assert before <= call.begun_ns <= time.monotonic_ns()
    assert 'look_around' in stack
    assert running.calls() == []


def test_a_running_coroutine_tells_where_it_waits():
    running = RunningCalls()

    class Pause:
        def __await__(self):
            yield

    async def behaviour():
        await Pause()

    coroutine = call_of(behaviour, running).run()
    coroutine.send(None)
    (call,) = running.calls()
    assert call.thread is None
    assert 'in behaviour' in call.format_stack()
    coroutine.close()
    assert running.calls() == []


def test_a_call_that_raises_is_no_longer_running():
    running, errors = RunningCalls(), []
    call = call_of(lambda: 1 / 0, running, failed=lambda owner, error: errors.append(error))
    assert call.run() is FAILED
    assert [type(error) for error in errors] == [ZeroDivisionError]
    assert running.wait_until_idle(0.0)


def test_waiting_for_idleness_ends_with_the_last_call():
    running = RunningCalls()
    may_end = [threading.Event(), threading.Event()]
    begun = threading.Barrier(3)

    def work(event):
        begun.wait(20.0)
        event.wait(20.0)

    threads = [
        threading.Thread(target=call_of(work, running).run, args=(event,)) for event in may_end
    ]
    for thread in threads:
        thread.start()
    begun.wait(20.0)
    idle = []
    waiters = [
        threading.Thread(target=lambda: idle.append(running.wait_until_idle(20.0)))
        for _ in range(2)
    ]
    for waiter in waiters:
        waiter.start()
    may_end[0].set()
    threads[0].join()
    assert not running.wait_until_idle(0.0)
    assert idle == []
    may_end[1].set()
    for thread in (*threads, *waiters):
        thread.join(20.0)
    assert idle == [True, True]


def test_what_is_still_to_be_done_is_awaited_but_does_not_run():
    running = RunningCalls()
    token = running.begin()
    assert running.calls() == []
    assert not running.wait_until_idle(0.0)
    running.end(token)
    assert running.wait_until_idle(0.0)
