"""Timers as sources: due at a deadline, or when their ROS clock gets there."""

import threading
from time import monotonic_ns
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle

from composer.executor import c_bindings
from composer.executor.event_source import NOTHING, Source
from composer.executor.missed import LATE_LEAST_NS, LATE_SHARE, Missed

if TYPE_CHECKING:
    from composer.executor.deadlines import ClockWatch
    from composer.executor.event_poller import Signal


class TimerSource(Source):
    """A timer: due at its deadline, or when its ROS clock gets there."""

    __slots__ = ('_arming', '_late', '_skipped', '_watched_clock', 'deadline_ns')

    def open(self, shared: 'Signal | None' = None) -> None:
        """See the base class."""
        self._arming = threading.Lock()
        self._late = 0
        self._skipped = 0
        self.deadline_ns: int | None = None
        self._watched_clock: ClockWatch | None = None
        self.signal = self.desk.board.attach(self, shared)
        try:
            with self.entity.handle:
                c_bindings.watch_timer_reset(self.entity.handle.pointer, self.signal.fd)
        except BaseException:
            self.desk.board.detach(self, self.signal)
            raise
        self._watched_clock = self.desk.alarms.follow(self.entity.clock, self)
        self.rearm()

    def close(self) -> None:
        """See the base class."""
        self.desk.alarms.set(self, None)
        if self._watched_clock is not None:
            self.desk.alarms.unfollow(self._watched_clock, self)
        self._unwatch(c_bindings.watch_timer_reset)

    def on_signal(self, count: int) -> None:  # noqa: ARG002
        """Hear of a reset."""
        self.rearm()

    def on_deadline(self) -> None:
        """Be ready; `run` asks rcl whether it is so."""
        self.desk.schedule.announce_once(self)

    def rearm(self) -> None:
        """Find out when the timer is due next."""
        with self._arming:
            self._rearm()

    def _rearm(self) -> None:
        try:
            handle = self.entity.handle
            with handle:
                until_ns = handle.time_until_next_call()
        except InvalidHandle:
            return
        watch = self._watched_clock
        if until_ns is None or not self.alive:
            self.desk.alarms.set(self, None)
        elif until_ns <= 0:
            self.desk.schedule.announce_once(self)
        elif watch is not None and watch.clock.ros_time_is_active:
            self.desk.alarms.set(self, None)
        else:
            self.desk.alarms.set(self, monotonic_ns() + until_ns)

    def run(self) -> Any:
        """See the base class."""
        timer = self.entity
        try:
            handle = timer.handle
            with handle:
                due = self._call(handle)
        except InvalidHandle:
            return NOTHING
        self.rearm()
        if not due:
            return NOTHING
        callback = timer.callback
        result = callback()
        return result if result is not None and self._is_async(callback) else None

    def missed(self) -> Missed:
        """See the base class."""
        return Missed(late_ticks=self._late, skipped_ticks=self._skipped)

    def _call(self, handle: Any) -> bool:
        """Tell rcl that the tick begins, and count what was missed; False if it is not due."""
        begin_ns = monotonic_ns()
        until_ns = handle.time_until_next_call()
        if until_ns is None or until_ns > 0:
            return False
        handle.call_timer()
        next_until_ns = handle.time_until_next_call()
        period_ns = handle.get_timer_period()
        if next_until_ns is None or not period_ns:
            return True
        if -until_ns > LATE_LEAST_NS and -until_ns > LATE_SHARE * period_ns:
            self._late += 1
        # rcl sets the next tick to the next multiple of the period that has not passed.
        advance_ns = next_until_ns - until_ns + monotonic_ns() - begin_ns
        self._skipped += max(0, advance_ns // period_ns - 1)
        return True
