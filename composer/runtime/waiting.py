"""Waiting for futures of rclpy with a deadline, in a thread or in a coroutine."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock, ClockType
from rclpy.task import Future

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from rclpy.callback_groups import CallbackGroup
    from rclpy.node import Node as RosNode

_POLL_SEC = 0.01


def wait_in_thread(
    future: Future, timeout_sec: float | None, waiting: Callable[[], AbstractContextManager[None]]
) -> bool:
    """Wait until a future is done; return whether it came to be in time.

    Args:
        timeout_sec: `None` for no end.
        waiting: The executor's context for callbacks that wait for others.
    """
    done = threading.Event()
    future.add_done_callback(lambda _future: done.set())
    if done.is_set():
        return True
    with waiting():
        return done.wait(timeout_sec)


def poll_in_thread(
    condition: Callable[[], bool],
    timeout_sec: float | None,
    waiting: Callable[[], AbstractContextManager[None]],
) -> bool:
    """Wait until a condition holds; return whether it came to hold in time."""
    if condition():
        return True
    deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
    with waiting():
        while not condition():
            if deadline is not None and time.monotonic() >= deadline:
                return False
            time.sleep(_POLL_SEC)
    return True


class CoroutineWaits:
    """The same for coroutines, which a timer of the node resumes.

    Args:
        group: A group that no behaviour is in, so that its timers always run.
    """

    def __init__(self, ros: RosNode, group: CallbackGroup) -> None:
        self._ros = ros
        self._group = group
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)

    async def until_done(self, future: Future, timeout_sec: float | None) -> bool:
        """Wait until a future is done; return whether it came to be in time."""
        if timeout_sec is None:
            await future
            return True
        first: Future = Future()
        future.add_done_callback(lambda _future: _set_once(first))
        timer = self._timer(timeout_sec, lambda: _set_once(first))
        try:
            await first
        finally:
            self._ros.destroy_timer(timer)
        return bool(future.done())

    async def until_true(self, condition: Callable[[], bool], timeout_sec: float | None) -> bool:
        """Wait until a condition holds; return whether it came to hold in time."""
        deadline = None if timeout_sec is None else time.monotonic() + timeout_sec
        first: Future = Future()

        def look() -> None:
            if condition() or (deadline is not None and time.monotonic() >= deadline):
                _set_once(first)

        look()
        if first.done():
            return condition()
        timer = self._timer(_POLL_SEC, look)
        try:
            await first
        finally:
            self._ros.destroy_timer(timer)
        return condition()

    def _timer(self, period_sec: float, callback: Callable[[], None]) -> Any:
        return self._ros.create_timer(
            period_sec, callback, callback_group=self._group, clock=self._clock
        )


def _set_once(future: Future) -> None:
    if not future.done():
        future.set_result(None)
