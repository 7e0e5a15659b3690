"""The executor's threads and their end."""

import _thread
import ctypes
import threading
import time

import pytest

pytest.importorskip('rclpy')

from spinning import DEADLINE_SEC, spinning, wait_for

from composer.executor.worker_threads import WorkerThreads

pytestmark = pytest.mark.ros


def test_threads_that_have_still_to_begin_count(monkeypatch):
    begin = _thread.start_new_thread
    late = []
    monkeypatch.setattr(_thread, 'start_new_thread', lambda work, _: late.append(work))
    threads = WorkerThreads(
        lambda worker: threads.is_leader(worker, lambda: False), pytest.fail, pytest.fail
    )
    threads.start()
    monkeypatch.undo()
    threads.end(0.0, lambda: None)
    assert threads.has_threads()
    for work in late:
        begin(work, ())
    wait_for(lambda: not threads.has_threads())
    threads.start()
    assert not threads.has_threads()


def test_shutdown_keeps_what_a_waiting_spin_once_waits_with(node, executor):
    poller = executor._spinner.poller
    wait_if, waiting, errors = poller.wait_if, threading.Event(), []

    def wait_twice(is_idle):
        waiting.set()
        wait_if(is_idle)
        time.sleep(0.01)
        wait_if(lambda: False)

    def spin():
        try:
            executor.spin_once()
        except BaseException as error:  # noqa: BLE001
            errors.append(error)

    poller.wait_if = wait_twice
    thread = threading.Thread(target=spin)
    thread.start()
    assert waiting.wait(DEADLINE_SEC)
    assert executor.shutdown()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()
    assert errors == []


class Thrown(Exception):  # noqa: N818
    """What a behaviour throws into threads."""


def test_the_executor_can_be_spun_on_when_its_waiting_threads_are_thrown_into(node, executor):
    ticks = []
    node.create_timer(0.05, lambda: ticks.append(1))
    thrown = []

    def spin():
        while not executor._is_shutdown:
            try:
                executor.spin()
            except Thrown as error:
                thrown.append(error)

    thread = threading.Thread(target=spin)
    thread.start()
    for _ in range(10):
        before = len(ticks)
        # While one sleeps, others take over; what is thrown reaches them where they wait, because
        # between two steps of the executor itself nothing can be promised.
        executor.create_task(time.sleep, 0.1)
        wait_for(lambda before=before: len(ticks) > before + 2)
        time.sleep(0.01)
        for ident in list(executor._spinner.workers._workers):
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(ident), ctypes.py_object(Thrown)
            )
    before = len(ticks)
    wait_for(lambda: len(ticks) > before + 2)
    executor.shutdown()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()
    assert thrown


def test_one_thread_is_enough_where_there_are_no_more(node, executor, monkeypatch):
    ticks = []
    node.create_timer(0.001, lambda: ticks.append(time.sleep(0.002)))
    begin = _thread.start_new_thread

    def refuse(*_):
        message = "can't start new thread"
        raise RuntimeError(message)

    def begin_last(*arguments):
        monkeypatch.setattr(_thread, 'start_new_thread', refuse)
        return begin(*arguments)

    monkeypatch.setattr(_thread, 'start_new_thread', begin_last)
    with spinning(executor) as errors:
        wait_for(lambda: len(ticks) > 5)
        monkeypatch.undo()
    assert errors == []


def test_callbacks_are_traced_as_in_other_threads(node, executor, monkeypatch):
    traced = set()

    def trace(frame, _event, _argument):
        traced.add(frame.f_code.co_name)

    def tick():
        timer.cancel()

    timer = node.create_timer(0.001, tick)
    monkeypatch.setattr(threading, '_trace_hook', trace)
    with spinning(executor) as errors:
        wait_for(timer.is_canceled)
    assert 'tick' in traced
    assert errors == []


def test_a_tracer_that_raises_ends_no_thread(node, executor, monkeypatch):
    def fail(*_):
        raise Thrown

    ran = []
    with spinning(executor) as errors:
        wait_for(executor._spinner.workers.has_threads)
        monkeypatch.setattr(threading, '_trace_hook', fail)
        monkeypatch.setattr(threading, '_profile_hook', fail)
        for _ in range(10):
            executor.create_task(lambda: ran.append(time.sleep(0.1)))
        wait_for(lambda: len(ran) == 10)
    assert errors == []
