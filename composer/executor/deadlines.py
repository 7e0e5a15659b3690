"""Deadlines: one heap, one kernel timer, and the clocks that can jump."""

import heapq
import itertools
import threading
from collections import deque
from time import monotonic_ns
from typing import Any, Protocol

from rclpy.clock import JumpThreshold, ROSClock
from rclpy.duration import Duration

from composer.executor.c_bindings import TimerFd

_ANY_JUMP = JumpThreshold(
    min_forward=Duration(nanoseconds=1),
    min_backward=Duration(nanoseconds=-1),
    on_clock_change=True,
)
_LEAST_GARBAGE = 64


class Alarm(Protocol):
    """Something that happens at `deadline_ns` (monotonic), if it is not None."""

    deadline_ns: int | None

    def on_deadline(self) -> None:
        """Do what is due."""


class ClockWatch:
    """The alarms that follow one ROS clock, whose time may jump or be set by a simulation."""

    def __init__(self, clock: ROSClock, alarms: 'Alarms') -> None:
        self.clock = clock
        self.followers: set[Any] = set()
        self._alarms = alarms
        self._handle = clock.create_jump_callback(_ANY_JUMP, post_callback=self._on_jump)

    def _on_jump(self, _: object) -> None:
        self._alarms.jumped.append(self)
        self._alarms.wake()

    def unregister(self) -> None:
        """Follow the clock no more."""
        self._handle.unregister()


class Alarms:
    """All deadlines of one executor."""

    rank = 0

    def __init__(self, wake: Any) -> None:
        self.timer = TimerFd(blocking=False)
        self.jumped: deque[ClockWatch] = deque()
        self.wake = wake
        self._lock = threading.Lock()
        self._heap: list[tuple[int, int, Alarm]] = []
        self._numbers = itertools.count()
        self._most = _LEAST_GARBAGE
        self._watches: dict[int, ClockWatch] = {}

    def set(self, alarm: Alarm, deadline_ns: int | None) -> None:
        """Make `alarm` due at `deadline_ns` instead of what was set before; None: never."""
        with self._lock:
            alarm.deadline_ns = deadline_ns
            if deadline_ns is None:
                return
            heapq.heappush(self._heap, (deadline_ns, next(self._numbers), alarm))
            if len(self._heap) > self._most:
                self._sweep()
            if self._heap[0][2] is alarm:
                self.timer.set_ns(deadline_ns)

    def on_signal(self, _: int) -> None:
        """Run what is due and set the timer for the next."""
        self.timer.read()
        due = []
        with self._lock:
            now = monotonic_ns()
            while self._heap and self._heap[0][0] <= now:
                deadline_ns, _number, alarm = heapq.heappop(self._heap)
                if alarm.deadline_ns == deadline_ns:
                    alarm.deadline_ns = None
                    due.append(alarm)
            if self._heap:
                self.timer.set_ns(self._heap[0][0])
        for alarm in due:
            alarm.on_deadline()

    def follow(self, clock: Any, follower: Any) -> ClockWatch | None:
        """Have `follower.rearm()` called after jumps of `clock`; None if it cannot jump."""
        if not isinstance(clock, ROSClock):
            return None
        with self._lock:
            watch = self._watches.get(id(clock))
            if watch is None:
                watch = self._watches[id(clock)] = ClockWatch(clock, self)
            watch.followers.add(follower)
            return watch

    def unfollow(self, watch: ClockWatch, follower: Any) -> None:
        """End what `follow` began."""
        with self._lock:
            watch.followers.discard(follower)
            if watch.followers or self._watches.pop(id(watch.clock), None) is None:
                return
        watch.unregister()

    def follow_jumps(self) -> None:
        """Rearm the followers of the clocks that have jumped."""
        while self.jumped:
            for follower in tuple(self.jumped.popleft().followers):
                follower.rearm()

    def _sweep(self) -> None:
        self._heap = [entry for entry in self._heap if entry[2].deadline_ns == entry[0]]
        heapq.heapify(self._heap)
        self._most = max(_LEAST_GARBAGE, 2 * len(self._heap))


class Delay:
    """Calls a function once, some time from now."""

    def __init__(self, alarms: Alarms, delay_sec: float, function: Any) -> None:
        self.deadline_ns: int | None = None
        self._alarms = alarms
        self._function = function
        alarms.set(self, monotonic_ns() + int(delay_sec * 1e9))

    def cancel(self) -> None:
        """Call it no more, if that is yet to come."""
        self._alarms.set(self, None)

    def on_deadline(self) -> None:
        """Call the function."""
        self._function()
