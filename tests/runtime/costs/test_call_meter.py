"""The processor time of calls, and how long others wait for the interpreter."""

import threading
import time
from contextlib import contextmanager

from composer.runtime.costs.call_meter import CallMeter
from composer.runtime.costs.process_costs import ProcessMeter
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


def test_a_call_is_given_what_its_thread_has_used_since_the_last_one():
    with measuring() as meter:
        meter.lap()
        before_ns = time.thread_time_ns()
        while time.thread_time_ns() < before_ns + ENOUGH_NS:
            loop()
        assert ENOUGH_NS <= meter.lap() <= time.thread_time_ns() - before_ns + ENOUGH_NS
        assert meter.lap() < ENOUGH_NS


def test_a_thread_that_sleeps_uses_nothing_and_one_that_is_new_has_no_mark():
    laps = []
    with measuring() as meter:
        meter.lap()
        time.sleep(0.05)
        laps.append(meter.lap())
        new = threading.Thread(target=lambda: (loop(), laps.append(meter.lap())))
        new.start()
        new.join()
    assert laps[0] < ENOUGH_NS
    assert laps[1] == 0


def test_a_call_that_does_not_end_is_measured_from_outside():
    used_ns = []
    with measuring() as meter:
        with running(loop) as thread:
            wait_until(
                lambda: (
                    used_ns.append(meter.lap_of(thread.ident, thread.native_id))
                    or sum(used_ns) > ENOUGH_NS
                ),
                'costs',
            )
        wait_until(lambda: meter.lap_of(thread.ident, thread.native_id) == 0, 'end of it')


def test_who_wants_the_interpreter_beside_a_loop_waits_for_it():
    def is_waited_for():
        waits = meter.take_waits()
        return waits is not None and waits.mean_ms > 0.2

    with measuring() as meter, running(loop):
        wait_until(is_waited_for, 'waits')


def test_nothing_is_measured_any_more_when_it_is_turned_off():
    before = threading.active_count()
    with measuring():
        assert threading.active_count() == before + 1
    assert threading.active_count() == before
    assert ProcessMeter().take(1.0).waits is None
