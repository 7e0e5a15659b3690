"""Waits with a deadline, in threads and in coroutines; a stop of the system ends all of them.

A wait that began before the stop was requested ends with `SystemStoppingError`, so that the
behaviour ends too. One that begins later, to switch something off, goes on; but only `on_stop`
waits for nodes, servers and messages that are not there yet.
"""

from __future__ import annotations

from contextlib import contextmanager, suppress
from functools import partial
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.task import Future

from composer.errors import SystemStoppingError
from composer.runtime.tracing.tracer import COROUTINE, tracer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from composer.executor import ComposerExecutor
    from composer.runtime.stop_request import StopRequest

_POLL_SEC = 0.01

# When it is said what is waited for: first after a second, then every ten.
_FIRST_NOTICE_SEC = 1.0
_NOTICE_PERIOD_SEC = 10.0

# What a wait for an item gets when a stop is requested.
_STOPPED = object()


def stopping_error() -> SystemStoppingError:
    """Return the error that ends a wait."""
    return SystemStoppingError('the system is stopping')


class WaitNotice:
    """Logs what is waited for, if that takes long; several may wait for the same.

    Args:
        log: Takes the text, as a logger does.
        what: What is waited for, as in `service '/ask'`.

    Attributes:
        what: The same.
    """

    def __init__(self, log: Callable[[str], Any], what: str) -> None:
        self._log = log
        self.what = what
        self._last = float('-inf')

    def log_if_due(self, begun: float, now: float | None = None) -> None:
        """Log it, if that is due for a wait that began at a time of `time.monotonic`.

        Args:
            begun: When the wait began.
            now: When the caller looked whether it has ended; `None` for this moment.
        """
        now = monotonic() if now is None else now
        if now - begun >= _FIRST_NOTICE_SEC and now - self._last >= _NOTICE_PERIOD_SEC:
            self._last = now
            self._log(f'Waiting for {self.what}…')


class Waits:
    """Waits of one node's behaviours; those of coroutines hold no thread meanwhile.

    Args:
        executor: Runs the behaviours.

    Attributes:
        node: The full name of the node.
    """

    def __init__(self, executor: ComposerExecutor, stop: StopRequest) -> None:
        self.stop = stop
        self.node = ''
        self._executor = executor
        self._may_wait_at_stop = False

    def make_room(self) -> AbstractContextManager[None]:
        """Let another callback run meanwhile, as this one waits for others."""
        return self._executor.waiting()

    def allow_at_stop(self) -> None:
        """Let `on_stop` wait for what is not there yet."""
        self._may_wait_at_stop = True

    def until_done(self, future: Future, timeout_sec: float | None) -> bool:
        """Wait until a future is done; return whether it was in time.

        Args:
            timeout_sec: `None` for no limit.

        Raises:
            SystemStoppingError: A stop was requested meanwhile; or before, and the wait has no
                limit.
        """
        if future.done():
            return True
        woken: SimpleQueue[Any] = SimpleQueue()
        wake = partial(woken.put, None)
        future.add_done_callback(woken.put)
        is_before_stop = self.stop.add_callback(wake)
        ends = is_before_stop or (timeout_sec is None and not self._may_wait_at_stop)
        try:
            if not (ends and self.stop.is_set):
                with self.make_room(), suppress(Empty):
                    woken.get(timeout=timeout_sec)
        finally:
            self.stop.remove_callback(wake)
        return self._finish(future, woken.put, is_ended=ends and self.stop.is_set)

    async def until_done_async(self, future: Future, timeout_sec: float | None) -> bool:
        """As `until_done`, for coroutines."""
        if future.done():
            return True
        first: Future = Future()

        def wake(_future: Future | None = None) -> None:
            if not first.done():
                first.set_result(None)

        future.add_done_callback(wake)
        with self._ended_by_stop(wake, timeout_sec) as is_ended:
            if is_ended():
                pass
            elif timeout_sec is None:
                await first
            else:
                await self._with_timeout(timeout_sec, wake, first)
        return self._finish(future, wake, is_ended=is_ended())

    async def until_answered_async(self, future: Future, timeout_sec: float | None) -> bool:
        """As `until_done_async`, for a future that nobody else waits for: one in vain cancels it.

        Every call of a service waits here, so it does with that one future.
        """
        if future.done():
            return True
        cancel = future.cancel
        is_before_stop = self.stop.add_callback(cancel)
        ends = is_before_stop or (timeout_sec is None and not self._may_wait_at_stop)
        timeout = None
        try:
            if not (ends and self.stop.is_set):
                if timeout_sec is not None:
                    timeout = self._executor.call_later(timeout_sec, cancel)
                await future
        finally:
            if timeout is not None:
                timeout.cancel()
            self.stop.remove_callback(cancel)
        if not future.done() and ends and self.stop.is_set:
            raise stopping_error()
        return bool(future.done())

    def until_next(self, items: SimpleQueue[Any]) -> Any:
        """Wait without a limit for the next item of a queue, and return it.

        Raises:
            SystemStoppingError: As `until_done`.
        """
        with self._ended_by_stop(lambda: items.put(_STOPPED), None) as is_ended:
            if not is_ended():
                with self.make_room():
                    item = items.get()
        if is_ended() or item is _STOPPED:
            raise stopping_error()
        return item

    def until_true(
        self, condition: Callable[[], bool], timeout_sec: float | None, notice: WaitNotice
    ) -> bool:
        """Wait until a condition holds; return whether it did in time.

        Args:
            timeout_sec: `None` for no limit.
            notice: Says what is waited for.

        Raises:
            SystemStoppingError: A stop was requested, and `on_stop` has not been called yet.
        """
        if condition():
            return True
        begun = monotonic()
        with self.make_room(), tracer.noting('wait', self.node, notice.what):
            while not condition():
                if self._is_refused():
                    raise stopping_error()
                if _is_over(begun, timeout_sec):
                    return False
                notice.log_if_due(begun)
                sleep(_POLL_SEC)
        return True

    async def until_true_async(
        self, condition: Callable[[], bool], timeout_sec: float | None, notice: WaitNotice
    ) -> bool:
        """As `until_true`, for coroutines."""
        if condition():
            return True
        begun = monotonic()
        with tracer.noting('wait', self.node, notice.what, COROUTINE):
            while not condition():
                if self._is_refused():
                    raise stopping_error()
                if _is_over(begun, timeout_sec):
                    return False
                notice.log_if_due(begun)
                pause: Future = Future()
                await self._with_timeout(_POLL_SEC, partial(pause.set_result, None), pause)
        return True

    @contextmanager
    def _ended_by_stop(
        self, wake: Callable[[], None], timeout_sec: float | None
    ) -> Iterator[Callable[[], bool]]:
        """Have `wake` called at a stop; return what tells whether a stop has ended the wait.

        A stop that was requested before ends only a wait without a limit.
        """
        with self.stop.waking(wake) as is_before_stop:
            ends = is_before_stop or (timeout_sec is None and not self._may_wait_at_stop)
            yield lambda: ends and self.stop.is_set

    def _finish(self, future: Future, wake: Callable[..., None], *, is_ended: bool) -> bool:
        """Return how a wait for a future has ended, or raise, as `until_done` does.

        Args:
            wake: The callback of the future, which is removed.
            is_ended: Whether a stop has ended the wait.
        """
        if future.done():
            return True
        future.remove_done_callback(wake)
        if is_ended:
            raise stopping_error()
        return False

    def _is_refused(self) -> bool:
        """Return whether behaviours may no longer wait for what is not there yet."""
        return self.stop.is_set and not self._may_wait_at_stop

    async def _with_timeout(
        self, timeout_sec: float, callback: Callable[[], Any], awaited: Future
    ) -> None:
        timeout = self._executor.call_later(timeout_sec, callback)
        try:
            await awaited
        finally:
            timeout.cancel()


def _is_over(begun: float, timeout_sec: float | None) -> bool:
    """Return whether a wait that began at a time of `time.monotonic` has used up its time."""
    return timeout_sec is not None and monotonic() >= begun + timeout_sec


# A behaviour that is in one of these waits for what is not there yet, and does not hang.
CODES_OF_ABSENCE = frozenset({Waits.until_true.__code__, Waits.until_true_async.__code__})
