"""Threads that take turns: one at a time, always in the same order, and none is left behind."""

import _thread
import os
import random
import sys
import threading
import time
import traceback
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from composer.virtual_time.originals import REAL
from composer.virtual_time.simulated_threads import NothingHappensError
from composer.virtual_time.stuck_threads import SimulationStuckError
from tests.virtual_time.virtual_runs import virtual_time


@given(
    delays=st.lists(st.lists(st.integers(0, 3), max_size=5), max_size=6),
    seed=st.none() | st.integers(0, 3),
)
@settings(max_examples=20)
def test_threads_run_in_the_same_order_each_time(delays, seed):
    def run():
        seen, lock = [], threading.Lock()

        def work(name, pauses):
            for each in pauses:
                time.sleep(each)
                with lock:
                    seen.append((name, time.monotonic_ns()))
                    time.sleep(each / 10)

        with virtual_time(seed):
            workers = [threading.Thread(target=work, args=each) for each in enumerate(delays)]
            for each in workers:
                each.start()
            for each in workers:
                each.join()
        return seen

    first = run()
    assert [run(), run()] == [first, first]
    assert [each[1] for each in first] == sorted(each[1] for each in first)
    assert len(first) == sum(map(len, delays))


def test_seeds_find_other_orders():
    def run(seed):
        seen = []

        def work(name):
            time.sleep(1)
            seen.append(name)

        with virtual_time(seed):
            workers = [threading.Thread(target=work, args=(each,)) for each in range(4)]
            for each in workers:
                each.start()
            for each in workers:
                each.join()
        return tuple(seen)

    assert run(None) == (0, 1, 2, 3)
    assert len({run(seed) for seed in range(20)}) > 6


def test_a_shuffled_race_is_found():
    """Two threads lose an update, where one is exchanged between a read and a write."""

    def run(seed):
        count = 0

        def add():
            nonlocal count
            for _ in range(20):
                seen = count
                count = seen + 1

        with virtual_time(seed):
            workers = [threading.Thread(target=add) for _ in range(2)]
            for each in workers:
                each.start()
            for each in workers:
                each.join()
        return count

    assert run(None) == 40
    counts = [run(seed) for seed in range(10)]
    assert min(counts) < 40
    assert counts == [run(seed) for seed in range(10)]


def test_a_wait_goes_on_after_nothing_happened():
    with virtual_time() as threads:
        with pytest.raises(NothingHappensError):
            threading.Event().wait()
        time.sleep(1)
        assert threads.now_ns == 1_000_000_000


def test_a_deadlock_ends():
    first, second = threading.Lock(), threading.Lock()

    def take():
        with second:
            time.sleep(1)
            first.acquire()

    with virtual_time(), first:
        threading.Thread(target=take).start()
        time.sleep(0.5)
        with pytest.raises(NothingHappensError):
            second.acquire()


def test_an_interrupt_waits_for_the_next_turn():
    """Else the thread that runs would go on beside the one from outside."""
    seen = []

    def work():
        _thread.interrupt_main()
        for _ in range(200):
            REAL.sleep(0.001)
        seen.append('waits')
        time.sleep(1)
        seen.append('ends')

    with virtual_time() as threads:
        thread = threading.Thread(target=work)
        with pytest.raises(KeyboardInterrupt):
            _start_and_wait(thread)
        assert seen == ['waits']
        assert threads.now_ns == 0
        time.sleep(2)
        assert seen == ['waits', 'ends']


def _loop_without_end():
    while True:
        pass


def _block_in_c():
    source, sink = os.pipe()
    threading.Timer(3, os.close, [source]).start()
    try:
        os.write(sink, bytes(1_000_000))
    except BrokenPipeError:
        os.close(sink)


def _start_and_wait(thread):
    thread.start()
    time.sleep(1)


@pytest.mark.parametrize('function', [_loop_without_end, _block_in_c])
def test_a_thread_that_never_waits_is_told_of(function):
    before = threading.active_count()
    with virtual_time(limit_sec=0.5):
        thread = threading.Thread(target=function)
        with pytest.raises(SimulationStuckError, match=r'within 0.5 s of real time') as caught:
            _start_and_wait(thread)
        stack = traceback.extract_stack(sys._current_frames()[caught.value.thread])
        assert function.__name__ in [each.name for each in stack]
        time.sleep(1 if function is _loop_without_end else 4)
    assert threading.active_count() == before


def test_one_that_was_given_up_does_no_more_harm():
    """It ends where it would wait next, and the others go on."""
    seen = []

    def work():
        begun = time.clock_gettime(time.CLOCK_PROCESS_CPUTIME_ID)
        while time.clock_gettime(time.CLOCK_PROCESS_CPUTIME_ID) < begun + 1.0:
            pass
        time.sleep(1)
        seen.append('given up')

    with virtual_time(limit_sec=0.3) as threads:
        with pytest.raises(SimulationStuckError):
            threading.Thread(target=work).start()
        with threads.outside():
            time.sleep(1.2)
        other = threading.Thread(target=lambda: time.sleep(2) or seen.append('other'))
        other.start()
        other.join()
    assert seen == ['other']


def _waits_for_ever():
    threading.Event().wait()


def _sleeps_long():
    time.sleep(1e6)


def _starts_others():
    for _ in range(3):
        threading.Thread(target=_waits_for_ever).start()
    time.sleep(1e6)


def _holds_a_lock():
    lock = threading.Lock()

    def hold():
        with lock:
            time.sleep(1e6)

    threading.Thread(target=hold).start()
    time.sleep(1)
    with lock:
        pass


def _waits_again_and_again():
    for _ in range(100):
        try:
            time.sleep(1e6)
        finally:
            time.sleep(1)


def _does_not_want_to_end():
    for _ in range(100):
        with suppress(SystemExit):
            threading.Event().wait()


def _waits_in_a_condition():
    condition = threading.Condition()

    def wait():
        with condition:
            condition.wait()

    for _ in range(3):
        threading.Thread(target=wait).start()
    wait()


@pytest.mark.parametrize(
    ('function', 'seed'),
    [
        (_starts_others, None),
        (_holds_a_lock, 1),
        (_waits_again_and_again, 1),
        (_does_not_want_to_end, None),
        (_waits_in_a_condition, 1),
    ],
)
def test_no_thread_is_left_at_the_end(function, seed):
    """Whatever they do then: they end, and nobody hears of errors that come of it."""
    begun = time.monotonic()
    with virtual_time(seed):
        each = [threading.Thread(target=function, daemon=True) for _ in range(3)]
        for thread in each:
            thread.start()
        time.sleep(10)
    for thread in each:
        thread.join(5)
        assert not thread.is_alive()
    assert time.monotonic() - begun < 5


def test_a_forked_process_has_real_time():
    with virtual_time():
        thread = threading.Thread(target=_sleeps_long)
        thread.start()
        process = os.fork()
        if process == 0:
            begun = time.monotonic()
            time.sleep(0.1)
            os._exit(0 if 0.1 <= time.monotonic() - begun < 10 else 1)
        assert os.waitpid(process, 0)[1] == 0


def test_chance_is_the_seed():
    numpy = pytest.importorskip('numpy')

    def run(seed):
        with virtual_time(seed):
            import secrets
            import tempfile
            import uuid

            unseeded = random.Random(), numpy.random.default_rng(), numpy.random.RandomState()
            random.seed()
            numpy.random.seed()
            return (
                *(str(each.random()) for each in (random, numpy.random, *unseeded)),
                *(os.urandom(4), os.getrandom(4), uuid.uuid4(), secrets.token_hex(), uuid.uuid1()),
                *(random.SystemRandom().random(), tempfile.mktemp()),
            )

    assert run(1) == run(1)
    for one, other in zip(run(1), run(2), strict=True):
        assert one != other
