"""The processor time of calls, and how long others wait for the interpreter."""

import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from composer.runtime.costs import call_meter
from composer.runtime.costs.call_meter import CallMeter
from tests.running import DEADLINE_SEC

ENOUGH_NS = 10_000_000


@contextmanager
def measuring():
    meter = CallMeter()
    meter.turn(on=True)
    try:
        yield meter
    finally:
        meter.turn(on=False)


@contextmanager
def running(work):
    """Yield a thread that does something again and again."""
    ended = threading.Event()

    def run():
        while not ended.is_set():
            work()

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield thread
    finally:
        ended.set()
        thread.join()


def wait_until(condition, what):
    deadline = time.monotonic() + DEADLINE_SEC
    while not condition():
        assert time.monotonic() < deadline, f'no {what}'
        time.sleep(0.01)


def loop():
    for _ in range(100_000):
        pass


def charge(meter, duration_ns=ENOUGH_NS):
    """Return what a call is given that ends now."""
    costs = SimpleNamespace(cpu_ns=0)
    meter.charge(costs, duration_ns)
    return costs.cpu_ns


def work():
    """Use as much of the processor as is seen; return how much."""
    before_ns = time.thread_time_ns()
    while time.thread_time_ns() < before_ns + ENOUGH_NS:
        loop()
    return time.thread_time_ns() - before_ns


def test_a_call_is_given_what_its_thread_has_used_since_the_last_one():
    with measuring() as meter:
        charge(meter)
        used_ns = work()
        assert ENOUGH_NS <= charge(meter) <= used_ns + ENOUGH_NS
        assert charge(meter) < ENOUGH_NS


def test_short_calls_share_what_they_have_used_by_how_long_they_took(monkeypatch):
    one, three, long = (SimpleNamespace(cpu_ns=0) for _ in range(3))
    monkeypatch.setattr(call_meter, '_READ_NS', 10**15)
    with measuring() as meter:
        begun_ns = time.thread_time_ns()
        charge(meter)
        meter.charge(one, 100_000)
        meter.charge(three, 300_000)
        assert one.cpu_ns == three.cpu_ns == 0
        work()
        with monkeypatch.context() as patched:
            patched.setattr(call_meter, '_READ_NS', 0)
            meter.charge(one, 100_000)
        assert ENOUGH_NS <= one.cpu_ns + three.cpu_ns <= time.thread_time_ns() - begun_ns
        assert 2 * three.cpu_ns == pytest.approx(3 * one.cpu_ns, abs=9)
        # One that took long may have waited: the short ones have no more than their time.
        before_ns = one.cpu_ns
        meter.charge(one, 100_000)
        work()
        meter.charge(long, ENOUGH_NS)
        assert one.cpu_ns == before_ns + 100_000
        assert long.cpu_ns >= ENOUGH_NS - 200_000


def test_a_call_that_does_not_end_is_measured_from_outside():
    costs = SimpleNamespace(cpu_ns=0)

    def grow():
        before_ns = costs.cpu_ns
        meter.charge_running(costs, thread.ident, thread.native_id)
        return costs.cpu_ns - before_ns

    with measuring() as meter:
        with running(loop) as thread:
            wait_until(lambda: (grow(), costs.cpu_ns > ENOUGH_NS)[1], 'costs')
        wait_until(lambda: grow() == 0, 'end of it')


def test_who_wants_the_interpreter_beside_a_loop_waits_for_it():
    def is_waited_for():
        waits = meter.take_waits()
        return waits is not None and waits.mean_ms > 0.2

    with measuring() as meter, running(loop):
        wait_until(is_waited_for, 'waits')
