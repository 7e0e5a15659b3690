"""Python's clocks in virtual time."""

from __future__ import annotations

import datetime as dt
import time
from threading import TIMEOUT_MAX
from typing import TYPE_CHECKING, Any, Final

from composer.virtual_time.originals import MOST_LOOKS, REAL
from composer.virtual_time.replaced_functions import ReplacedFunction, ReplacedMethod

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.virtual_time.simulated_threads import SimulatedThreads

# What the monotonic clocks say at the virtual time 0: some take 0 for a time that is not set.
MONOTONIC_START_NS: Final = 1_000_000_000_000
_SECOND_NS: Final = 1_000_000_000


def to_ns(seconds: float) -> int:
    """Return a duration in nanoseconds: the nearest, so that 0.067 s is what was written."""
    return round(seconds * 1e9)


def is_duration(seconds: Any) -> bool:
    """Tell whether waits take it; what they do not take they refuse themselves."""
    is_number = isinstance(seconds, float) or hasattr(seconds, '__index__')
    return is_number and 0 <= seconds <= TIMEOUT_MAX


def clocks(
    threads: SimulatedThreads, start_time_ns: int, on_work: Callable[[str], None]
) -> Iterator[tuple[Any, Callable[..., Any]]]:
    """Yield what reads or shows the time, and what does that instead.

    Args:
        start_time_ns: What the wall clock says at the virtual time 0, in ns since 1970.
        on_work: Called with the name of a function that reads a clock which counts work.
    """
    for name in ('monotonic', 'perf_counter'):
        yield _clock(threads, getattr(time, name), MONOTONIC_START_NS, 1e9)
        yield _clock(threads, getattr(time, f'{name}_ns'), MONOTONIC_START_NS, 1)
    yield _clock(threads, time.time, start_time_ns, 1e9)
    yield _clock(threads, time.time_ns, start_time_ns, 1)
    for name, divisor in (('clock_gettime', 1e9), ('clock_gettime_ns', 1)):
        builtin = getattr(time, name)
        yield _clock_by_identifier(threads, builtin, start_time_ns, divisor, on_work)
    for name, place in (('localtime', 0), ('gmtime', 0), ('ctime', 0)):
        yield _calendar(threads, getattr(time, name), place, time.time)
    for name, place in (('strftime', 1), ('asctime', 0)):
        yield _calendar(threads, getattr(time, name), place, time.localtime)
    yield from _datetimes(threads)


def _clock(
    threads: SimulatedThreads, builtin: Any, start_ns: int, divisor: float
) -> tuple[Any, Callable[..., Any]]:
    target = ReplacedFunction(builtin)
    # Each callback reads the time several times.
    original, by_ident = target.original, threads.by_ident
    # Deadlines of waits are computed from it, and would drift.
    is_exact = 'monotonic' in builtin.__name__
    clock = builtin.__name__.removesuffix('_ns')
    get_ident = REAL.get_ident

    def read_ns() -> Any:
        thread = by_ident.get(get_ident()) or threads.mine()
        if thread is None:
            return original()
        thread.looks += 1
        if thread.looks > MOST_LOOKS:
            threads.let_time_pass(thread)
        return start_ns + (threads.now_ns if is_exact else threads.read_ns(clock))

    def read_sec() -> Any:
        thread = by_ident.get(get_ident()) or threads.mine()
        if thread is None:
            return original()
        thread.looks += 1
        if thread.looks > MOST_LOOKS:
            threads.let_time_pass(thread)
        return (start_ns + (threads.now_ns if is_exact else threads.read_ns(clock))) / divisor

    return target, read_ns if divisor == 1 else read_sec


def _clock_by_identifier(
    threads: SimulatedThreads,
    builtin: Any,
    start_time_ns: int,
    divisor: float,
    on_work: Callable[[str], None],
) -> tuple[Any, Callable[..., Any]]:
    target = ReplacedFunction(builtin)
    starts = {
        number: start
        for name, start in (
            ('CLOCK_REALTIME', start_time_ns),
            ('CLOCK_TAI', start_time_ns),
            ('CLOCK_MONOTONIC', MONOTONIC_START_NS),
            ('CLOCK_MONOTONIC_RAW', MONOTONIC_START_NS),
            ('CLOCK_BOOTTIME', MONOTONIC_START_NS),
        )
        if (number := getattr(time, name, None)) is not None
    }

    def read(*arguments: Any) -> Any:
        start = starts.get(arguments[0]) if len(arguments) == 1 else None
        thread = threads.mine()
        if start is None or thread is None:
            if thread is not None:
                on_work(builtin.__name__)
            return target.original(*arguments)
        threads.count_look(thread)
        now_ns = start + threads.now_ns
        return now_ns if divisor == 1 else now_ns / divisor

    return target, read


def _calendar(
    threads: SimulatedThreads, builtin: Any, place: int, now: Callable[[], Any]
) -> tuple[Any, Callable[..., Any]]:
    """Return what shows a time, which is now unless the argument at `place` says otherwise."""
    target = ReplacedFunction(builtin)

    def show(*arguments: Any) -> Any:
        if threads.mine() is not None and len(arguments) <= place + 1:
            given = arguments[place] if len(arguments) > place else None
            if given is None and len(arguments) >= place:
                arguments = (*arguments[:place], now())
        return target.original(*arguments)

    return target, show


def _datetimes(threads: SimulatedThreads) -> Iterator[tuple[Any, Any]]:
    target = ReplacedMethod(dt.datetime, 'now')
    now_of = target.original

    def now(cls: Any, tz: Any = None) -> Any:
        if threads.mine() is None:
            return now_of.__get__(None, cls)(tz)
        seconds, rest_ns = divmod(time.time_ns(), _SECOND_NS)
        return cls.fromtimestamp(seconds, tz).replace(microsecond=rest_ns // 1000)

    yield target, classmethod(now)
    utc_target = ReplacedMethod(dt.datetime, 'utcnow')
    utc_of = utc_target.original

    def utcnow(cls: Any) -> Any:
        if threads.mine() is None:
            return utc_of.__get__(None, cls)()
        return now(cls, dt.UTC).replace(tzinfo=None)

    yield utc_target, classmethod(utcnow)
