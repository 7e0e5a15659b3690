"""What Python programs wait with, in virtual time.

A wait tries, without blocking, what it would block for, as long as others run.
"""

from __future__ import annotations

import _io
import _queue
import _socket
import _thread
import os
import select
import threading
import time
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from composer.virtual_time.clocks import is_duration, to_ns
from composer.virtual_time.originals import LOCK_TYPE, REAL
from composer.virtual_time.replaced_functions import ReplacedFunction, ReplacedMethod

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.virtual_time.simulated_threads import SimulatedThreads
    from composer.virtual_time.unrepeatable import Watch

_NO_TIMEOUT: Final = -1
# The arguments of `select.select` before the time-out.
_FILES: Final = 3
# What waits until something can be read from its first argument.
_READS: Final[tuple[tuple[Any, tuple[str, ...]], ...]] = (
    (_socket.socket, ('_accept', 'recv', 'recv_into', 'recvfrom', 'recvfrom_into')),
    (_socket.socket, ('recvmsg', 'recvmsg_into')),
    (_io.FileIO, ('read', 'readall', 'readinto')),
    (os, ('read', 'readv')),
)


def blocking_calls(
    threads: SimulatedThreads, watch: Watch
) -> Iterator[tuple[Any, Callable[..., Any]]]:
    """Yield what blocks a thread, and what does that instead."""
    sleep = ReplacedFunction(time.sleep)

    def sleep_virtually(seconds: Any) -> None:
        if threads.mine() is None or not is_duration(seconds):
            sleep.original(seconds)
        else:
            threads.sleep(to_ns(seconds))

    yield sleep, sleep_virtually
    yield from _locks(threads)
    yield from _reentrant_locks(threads)
    yield from _queues(threads)
    yield from _selectors(threads)
    yield from _reads(threads, watch)
    start = ReplacedFunction(_thread.start_new_thread)

    def start_new_thread(function: Any, arguments: Any, *keywords: Any) -> Any:
        is_called_by_python = isinstance(getattr(function, '__self__', None), threading.Thread)
        is_valid = callable(function) and all(
            map(isinstance, (arguments, *keywords), (tuple, dict))
        )
        if threads.mine() is None or is_called_by_python or not is_valid:
            return start.original(function, arguments, *keywords)
        call = partial(function, *arguments, **(keywords[0] if keywords else {}))
        with threads.added(call) as thread:
            return start.original(threads.run, (thread,))

    yield start, start_new_thread


def _wait_for_turns(
    threads: SimulatedThreads,
    is_free: Callable[[], object],
    take: Callable[[], Any],
    timeout_sec: float | None,
) -> Any:
    """Wait until something is free and can be taken; return what was, or something false."""
    timeout_ns = None if timeout_sec is None else to_ns(timeout_sec)
    until_ns = None if timeout_ns is None else threads.now_ns + timeout_ns
    while True:
        left_ns = None if until_ns is None else until_ns - threads.now_ns
        if not threads.wait_until(is_free, left_ns):
            return take()
        # Another one may have been faster.
        if taken := take():
            return taken


def _acquiring(
    threads: SimulatedThreads, real_acquire: Callable[..., Any], is_free: Callable[[Any], bool]
) -> Callable[..., Any]:
    """Return the method `acquire` of a kind of locks."""

    def acquire(self: Any, blocking: Any = True, timeout: Any = _NO_TIMEOUT) -> Any:  # noqa: FBT002 - as C has it
        if blocking and (timeout == _NO_TIMEOUT or is_duration(timeout)):
            if real_acquire(self, False):
                return True
            if threads.mine() is None:
                return real_acquire(self, blocking, timeout)
            limit = None if timeout == _NO_TIMEOUT else timeout
            take = lambda: real_acquire(self, False)  # noqa: E731
            return _wait_for_turns(threads, lambda: is_free(self), take, limit)
        return real_acquire(self, blocking, timeout)

    return acquire


def _locks(threads: SimulatedThreads) -> Iterator[tuple[ReplacedMethod, Callable[..., Any]]]:
    real_acquire = REAL.acquire
    acquire = _acquiring(threads, real_acquire, lambda lock: not lock.locked())

    def enter(self: Any) -> Any:
        return real_acquire(self, False) or acquire(self)

    for name in ('acquire', 'acquire_lock'):
        yield ReplacedMethod(LOCK_TYPE, name), acquire
    yield ReplacedMethod(LOCK_TYPE, '__enter__'), enter


def _reentrant_locks(
    threads: SimulatedThreads,
) -> Iterator[tuple[ReplacedMethod, Callable[..., Any]]]:
    lock_type: Any = _thread.RLock
    target = ReplacedMethod(lock_type, 'acquire')
    entry = ReplacedMethod(lock_type, '__enter__')
    restoring = ReplacedMethod(lock_type, '_acquire_restore')
    real_acquire = target.original

    # Nothing else tells whether somebody has it.
    acquire = _acquiring(threads, real_acquire, lambda lock: repr(lock).startswith('<unlocked'))

    def acquire_restore(self: Any, state: Any) -> None:
        if threads.mine() is None:
            restoring.original(self, state)
            return
        acquire(self)
        for _ in range(state[0] - 1):
            real_acquire(self)

    def enter(self: Any) -> Any:
        return real_acquire(self, False) or acquire(self)

    yield target, acquire
    yield entry, enter
    yield restoring, acquire_restore


def _queues(threads: SimulatedThreads) -> Iterator[tuple[ReplacedMethod, Callable[..., Any]]]:
    target = ReplacedMethod(_queue.SimpleQueue, 'get')
    real_get = target.original

    def get(self: Any, block: Any = True, timeout: Any = None) -> Any:  # noqa: FBT002
        is_wait = block and (timeout is None or is_duration(timeout))
        if not is_wait or threads.mine() is None:
            return real_get(self, block, timeout)

        def take() -> Any:
            try:
                return (real_get(self, False),)
            except _queue.Empty:
                return None

        taken = take() or _wait_for_turns(threads, lambda: not self.empty(), take, timeout)
        if taken is None:
            raise _queue.Empty
        return taken[0]

    yield target, get


def _selectors(threads: SimulatedThreads) -> Iterator[tuple[Any, Callable[..., Any]]]:
    """Yield what waits for files: what another thread of the process writes comes in its turn."""
    for owner, unit in ((select.epoll, 1.0), (type(select.poll()), 1e-3)):
        yield _polling(threads, ReplacedMethod(owner, 'poll'), unit)
    yield _selecting(threads, ReplacedFunction(select.select))


def _polling(
    threads: SimulatedThreads, target: ReplacedMethod, unit_sec: float
) -> tuple[ReplacedMethod, Callable[..., Any]]:
    real_poll = target.original

    def poll(self: Any, timeout: Any = None, *arguments: Any, **keywords: Any) -> Any:
        def look() -> Any:
            return real_poll(self, 0, *arguments, **keywords)

        is_endless = timeout is None or (isinstance(timeout, int | float) and timeout < 0)
        is_wait = timeout != 0 and (is_endless or is_duration(timeout))
        if not is_wait or threads.mine() is None:
            return real_poll(self, timeout, *arguments, **keywords)
        limit = None if is_endless else timeout * unit_sec
        return look() or _wait_for_turns(threads, look, look, limit)

    return target, poll


def _selecting(
    threads: SimulatedThreads, target: ReplacedFunction
) -> tuple[ReplacedFunction, Callable[..., Any]]:
    real_select: Callable[..., Any] = target.original

    def select_virtually(*arguments: Any) -> Any:
        timeout = arguments[3] if len(arguments) > _FILES else None
        is_wait = timeout is None or (timeout != 0 and is_duration(timeout))
        if threads.mine() is None or len(arguments) < _FILES or not is_wait:
            return real_select(*arguments)

        def look() -> Any:
            found = real_select(*arguments[:_FILES], 0)
            return found if any(found) else None

        return look() or _wait_for_turns(threads, look, look, timeout) or ([], [], [])

    return target, select_virtually


def _reads(threads: SimulatedThreads, watch: Watch) -> Iterator[tuple[Any, Callable[..., Any]]]:
    """Yield what reads from sockets, pipes and other files, and waits for what is not there."""
    for owner, names in _READS:
        for name in names:
            is_type = isinstance(owner, type)
            target: Any = (
                ReplacedMethod(owner, name) if is_type else ReplacedFunction(getattr(owner, name))
            )
            yield target, _reading(threads, watch, target.original)


def _reading(
    threads: SimulatedThreads, watch: Watch, real_read: Callable[..., Any]
) -> Callable[..., Any]:
    def read(file: Any, *arguments: Any, **keywords: Any) -> Any:
        # What comes from other processes comes in real time.
        if threads.mine() is not None and not watch.hears_others:
            timeout, poller = _timeout_of(file), select.poll()
            with suppress(OSError, TypeError, ValueError):
                poller.register(file, select.POLLIN)

            def look() -> object:
                return poller.poll(0)

            is_wait = timeout != 0 and not look()
            if is_wait and not _wait_for_turns(threads, look, look, timeout):
                message = 'timed out'
                raise TimeoutError(message)
        return real_read(file, *arguments, **keywords)

    return read


def _timeout_of(file: Any) -> float | None:
    """Return how long a read of a file waits, in seconds; `None` for ever."""
    if isinstance(file, _socket.socket):
        return file.gettimeout()
    try:
        return None if os.get_blocking(file if isinstance(file, int) else file.fileno()) else 0.0
    except (OSError, TypeError, ValueError):
        # The read says what is wrong.
        return 0.0
