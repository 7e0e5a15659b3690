# ruff: noqa: DTZ002, DTZ003, DTZ005, DTZ006, DTZ011
"""Clocks show virtual time, to the threads that are in it."""

import datetime as dt
import threading
import time
from datetime import datetime
from time import monotonic, time_ns

import pytest

from tests.virtual_time.virtual_runs import START_NS, virtual_time

START_SEC = START_NS // 10**9
PASSED_SEC = 1.5


def _default_argument(read=time.time):
    return read()


CLOCKS = {
    'time': time.time,
    'time_ns': lambda: time_ns() / 1e9,
    'default argument': _default_argument,
    'clock_gettime': lambda: time.clock_gettime(time.CLOCK_REALTIME),
    'clock_gettime_ns': lambda: time.clock_gettime_ns(time.CLOCK_REALTIME) / 1e9,
    'monotonic': monotonic,
    'monotonic_ns': lambda: time.monotonic_ns() / 1e9,
    'perf_counter': time.perf_counter,
    'perf_counter_ns': lambda: time.perf_counter_ns() / 1e9,
    'clock_gettime monotonic': lambda: time.clock_gettime(time.CLOCK_MONOTONIC),
    'datetime.now': lambda: datetime.now().timestamp(),
    'datetime.now of a zone': lambda: dt.datetime.now(dt.UTC).timestamp(),
    'datetime.now of another zone': lambda: datetime.now(
        tz=dt.timezone(dt.timedelta(hours=2))
    ).timestamp(),
    'datetime.utcnow': lambda: datetime.utcnow().replace(tzinfo=dt.UTC).timestamp(),
    'datetime.today': lambda: datetime.today().timestamp(),
}
# These have no fractions of a second.
CALENDARS = {
    'localtime': lambda: time.mktime(time.localtime()),
    'gmtime': lambda: dt.datetime(*time.gmtime()[:6], tzinfo=dt.UTC).timestamp(),
    'ctime': lambda: time.mktime(time.strptime(time.ctime())),
    'ctime of nothing': lambda: time.mktime(time.strptime(time.ctime(None))),
    'asctime': lambda: time.mktime(time.strptime(time.asctime())),
    'strftime': lambda: time.mktime(
        time.strptime(time.strftime('%Y-%m-%d %H:%M:%S'), '%Y-%m-%d %H:%M:%S')
    ),
    'date.today': lambda: dt.datetime.combine(dt.date.today(), dt.time()).timestamp(),
}


@pytest.mark.parametrize('name', CLOCKS)
def test_a_clock_shows_the_virtual_time(name):
    read = CLOCKS[name]
    with virtual_time():
        first = read()
        if 'perf' in name:
            # Libraries divide by the difference.
            assert 0 < read() - first < 1e-8
        else:
            # Of the wall clock, seconds as a float show no nanosecond.
            assert read() == first
        time.sleep(PASSED_SEC)
        assert read() - first == pytest.approx(PASSED_SEC, abs=1e-6)
        if 'monotonic' not in name and 'perf' not in name:
            assert first == START_SEC


@pytest.mark.parametrize('name', CALENDARS)
def test_a_calendar_shows_the_virtual_time(name):
    read = CALENDARS[name]
    with virtual_time():
        day = 86400
        time.sleep(day + PASSED_SEC)
        passed = read() - START_SEC
    assert passed == (day + 1 if name != 'date.today' else day)


def test_a_given_time_is_shown_as_ever():
    given = 86400 * 365.0
    before = (
        time.gmtime(given), time.ctime(given), time.strftime('%Y', time.gmtime(given)),
        time.asctime(time.gmtime(given)), datetime.fromtimestamp(given),
    )  # fmt: skip
    with virtual_time():
        assert before == (
            time.gmtime(given), time.ctime(given), time.strftime('%Y', time.gmtime(given)),
            time.asctime(time.gmtime(given)), datetime.fromtimestamp(given),
        )  # fmt: skip


def test_nanoseconds_are_exact():
    with virtual_time():
        first = time.time_ns(), time.monotonic_ns()
        time.sleep(1e-9)
        time.sleep(3600)
        passed = 3600 * 10**9 + 1
        assert (time.time_ns(), time.monotonic_ns()) == (first[0] + passed, first[1] + passed)


def test_other_threads_have_real_time():
    seen = []

    def look():
        time.sleep(0.05)
        seen.append((time.time(), threading.Event().wait(0.01), datetime.now().year))

    with virtual_time() as threads:
        with threads.outside():
            thread = threading.Thread(target=look)
            thread.start()
        time.sleep(1000)
        with threads.outside():
            thread.join()
    assert abs(seen[0][0] - time.time()) < 60
    assert seen[0][2] == datetime.now().year


def test_everything_is_as_before_afterwards():
    names = ('acquire', 'acquire_lock', '__enter__')
    lock_type, rlock_type = type(threading.Lock()), type(threading.RLock())

    def snapshot():
        return (
            [lock_type.__dict__[name] for name in names],
            [rlock_type.__dict__[name] for name in ('acquire', '__enter__', '_acquire_restore')],
            [dt.datetime.__dict__[name] for name in ('now', 'utcnow')],
            [threading.Thread.__dict__[name] for name in ('start', 'join', 'is_alive')],
            __import__('select').select,
            __import__('random').getstate(),
        )

    before, begun = snapshot(), time.time()
    with virtual_time():
        assert snapshot() != before
        time.sleep(3)
    assert snapshot() == before
    assert 0 <= time.time() - begun < 2
    begun = time.monotonic()
    time.sleep(0.02)
    assert time.monotonic() - begun >= 0.02


def test_time_passes_in_a_loop_that_only_looks_at_a_clock():
    with virtual_time() as threads:
        end = time.monotonic() + 0.1
        while time.monotonic() < end:
            pass
        assert threads.now_ns == 100_000_000


def test_time_passes_where_threads_yield_to_each_other():
    def yield_for(seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(0)

    with virtual_time() as threads:
        others = [threading.Thread(target=yield_for, args=(0.1,)) for _ in range(3)]
        for each in others:
            each.start()
        for each in others:
            each.join()
        assert 100_000_000 <= threads.now_ns < 110_000_000


def test_no_time_passes_for_those_who_look_now_and_then():
    with virtual_time() as threads:
        for _ in range(500):
            time.monotonic()
        assert threads.now_ns == 0
