"""Waiting with a deadline, in a thread or in a coroutine; a stop of the system ends every wait.

A wait that began before the stop was requested ends by `SystemStoppingError`, so that the
behaviour ends too. One that begins later is for what must be switched off, and goes on; but
nothing except `on_stop` waits for somebody who is not there yet.
"""

from __future__ import annotations

import threading
from functools import partial
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.task import Future

from composer.errors import SystemStoppingError

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from composer.executor import ComposerExecutor
    from composer.runtime.stop_request import StopRequest

_POLL_SEC = 0.01


def stopping_error() -> SystemStoppingError:
    """Return what ends a wait."""
    return SystemStoppingError('the system stops, and nothing more is waited for')


class ThreadWaits:
    """Waits of behaviours that are plain functions.

    Args:
        make_room: The executor's context for callbacks that wait for others.
    """

    def __init__(
        self, make_room: Callable[[], AbstractContextManager[None]], stop: StopRequest
    ) -> None:
        self.make_room = make_room
        self.stop = stop
        self._is_patient = False

    def allow(self) -> None:
        """Let `on_stop` wait for whom it needs."""
        self._is_patient = True

    def until_done(self, future: Future, timeout_sec: float | None) -> bool:
        """Wait until a future is done; return whether it came to be in time.

        Args:
            timeout_sec: `None` for no end.

        Raises:
            SystemStoppingError: A stop was requested meanwhile; or before, and the wait would
                have no end.
        """
        self.refuse_endless(future, timeout_sec)
        woken = threading.Event()

        def wake(_future: Future | None = None) -> None:
            woken.set()

        future.add_done_callback(wake)
        if future.done():
            return True
        with self.stop.waking(wake) as yields, self.make_room():
            woken.wait(timeout_sec)
        return self.ended(future, wake, yields=yields)

    def until_true(self, condition: Callable[[], bool], timeout_sec: float | None) -> bool:
        """Wait until a condition holds; return whether it came to hold in time.

        Raises:
            SystemStoppingError: A stop was requested, and `on_stop` has not been called yet.
        """
        if condition():
            return True
        deadline = None if timeout_sec is None else monotonic() + timeout_sec
        with self.make_room():
            while not condition():
                if self.gives_up():
                    raise stopping_error()
                if deadline is not None and monotonic() >= deadline:
                    return False
                sleep(_POLL_SEC)
        return True

    def ended(self, future: Future, wake: Callable[..., None], *, yields: bool) -> bool:
        """Say how a wait has ended, as `until_done` does.

        Args:
            wake: The future's callback, which is taken back.
            yields: Whether the wait began before a stop.
        """
        if future.done():
            return True
        future.remove_done_callback(wake)
        if yields and self.stop.is_set:
            raise stopping_error()
        return False

    def refuse_endless(self, future: Future, timeout_sec: float | None) -> None:
        """Begin no wait without an end when the system stops already.

        Raises:
            SystemStoppingError: It does, and `on_stop` has not been called yet.
        """
        if timeout_sec is None and self.gives_up() and not future.done():
            raise stopping_error()

    def gives_up(self) -> bool:
        """Return whether nobody is to be waited for who is not there."""
        return self.stop.is_set and not self._is_patient


class CoroutineWaits:
    """The same for coroutines, which the executor resumes.

    Args:
        threads: The waits of the same node's threads.
    """

    def __init__(self, executor: ComposerExecutor, threads: ThreadWaits) -> None:
        self._executor = executor
        self._threads = threads

    async def until_done(self, future: Future, timeout_sec: float | None) -> bool:
        """See `ThreadWaits.until_done`."""
        self._threads.refuse_endless(future, timeout_sec)
        first: Future = Future()

        def wake(_future: Future | None = None) -> None:
            if not first.done():
                first.set_result(None)

        future.add_done_callback(wake)
        with self._threads.stop.waking(wake) as yields:
            if timeout_sec is None:
                await first
            else:
                await self._or_later(timeout_sec, wake, first)
        return self._threads.ended(future, wake, yields=yields)

    async def until_true(self, condition: Callable[[], bool], timeout_sec: float | None) -> bool:
        """See `ThreadWaits.until_true`."""
        deadline = None if timeout_sec is None else monotonic() + timeout_sec
        while not condition():
            if self._threads.gives_up():
                raise stopping_error()
            if deadline is not None and monotonic() >= deadline:
                return False
            pause: Future = Future()
            await self._or_later(_POLL_SEC, partial(pause.set_result, None), pause)
        return True

    async def _or_later(
        self, delay_sec: float, callback: Callable[[], Any], awaited: Future
    ) -> None:
        delay = self._executor.call_later(delay_sec, callback)
        try:
            await awaited
        finally:
            delay.cancel()
