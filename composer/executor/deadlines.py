"""Deadlines of timers and delayed calls: one heap, one kernel timer, and clocks that can jump."""

import heapq
import itertools
import threading
import weakref
from collections import deque
from collections.abc import Callable
from time import monotonic_ns
from typing import Any, Protocol

from rclpy.clock import JumpThreshold, ROSClock
from rclpy.duration import Duration

from composer.executor.descriptors import TimerFd

_ANY_JUMP = JumpThreshold(
    min_forward=Duration(nanoseconds=1),
    min_backward=Duration(nanoseconds=-1),
    on_clock_change=True,
)
_MIN_HEAP_LIMIT = 64


class Timed(Protocol):
    """Something that happens at `deadline_ns` (monotonic), if it is not None."""

    deadline_ns: int | None

    def on_deadline(self) -> None:
        """Do what is due."""


class JumpingClock:
    """A ROS clock and what follows it; its time may jump or be set by a simulation."""

    def __init__(self, clock: ROSClock, deadlines: 'Deadlines') -> None:
        self.clock = clock
        self.followers: set[Any] = set()
        self._deadlines = deadlines
        # The clock keeps it where Python's garbage collector does not look.
        me = weakref.proxy(self)
        self._handle = clock.create_jump_callback(
            _ANY_JUMP, post_callback=lambda _: me.note_jump()
        )

    def note_jump(self) -> None:
        """Have the followers rearmed."""
        self._deadlines.jumped.append(self)
        self._deadlines.wake()

    def unregister(self) -> None:
        """Remove the jump callback."""
        self._handle.unregister()


class Deadlines:
    """All deadlines of one executor.

    Args:
        wake: Makes a thread that waits call `rearm_after_jumps`.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self.timer = self._create_timer()
        self.jumped: deque[JumpingClock] = deque()
        self.wake = wake
        self._lock = threading.RLock()  # A finalizer may end the executor.
        # Lists of a deadline, a number and what is timed; None in its place if that is replaced.
        self._heap: list[list[Any]] = []
        self._entries: dict[Timed, list[Any]] = {}
        self._numbers = itertools.count()
        self._heap_limit = _MIN_HEAP_LIMIT
        self._clocks: dict[int, JumpingClock] = {}

    def _create_timer(self) -> TimerFd:
        return TimerFd(blocking=False)

    def set(self, timed: Timed, deadline_ns: int | None) -> None:
        """Replace the deadline of `timed`; None for no deadline."""
        with self._lock:
            timed.deadline_ns = deadline_ns
            replaced = self._entries.pop(timed, None)
            if replaced is not None:
                # What is gone would be kept in memory until its deadline, with its node.
                replaced[-1] = None
            if deadline_ns is None:
                return
            entry = self._entries[timed] = [deadline_ns, self._number(timed), timed]
            heapq.heappush(self._heap, entry)
            if len(self._heap) > self._heap_limit:
                self._drop_replaced()
            # An earlier entry of the same may be the first: others come between the two.
            if self._heap[0] is entry:
                self.timer.expire_at(deadline_ns)

    def _number(self, _timed: Timed) -> Any:
        """Return what orders `timed` among those with the same deadline; no two are equal."""
        return next(self._numbers)

    def run_due(self) -> None:
        """Call `on_deadline` of all that is due, and set the kernel timer for the next."""
        self.timer.read()
        due = []
        with self._lock:
            now = monotonic_ns()
            while self._heap and self._heap[0][0] <= now:
                timed = heapq.heappop(self._heap)[-1]
                if timed is not None:
                    del self._entries[timed]
                    timed.deadline_ns = None
                    due.append(timed)
            if self._heap:
                self.timer.expire_at(self._heap[0][0])
        for timed in due:
            timed.on_deadline()

    def follow(self, clock: Any, follower: Any) -> JumpingClock | None:
        """Have `follower.rearm()` called after jumps of `clock`; None if it cannot jump."""
        if not isinstance(clock, ROSClock):
            return None
        with self._lock:
            followed = self._clocks.get(id(clock))
            if followed is None:
                followed = self._clocks[id(clock)] = JumpingClock(clock, self)
            followed.followers.add(follower)
            return followed

    def unfollow(self, followed: JumpingClock, follower: Any) -> None:
        """Undo `follow`."""
        with self._lock:
            followed.followers.discard(follower)
            if followed.followers or self._clocks.pop(id(followed.clock), None) is None:
                return
        followed.unregister()

    def rearm_after_jumps(self) -> None:
        """Call `rearm` of the followers of the clocks that have jumped."""
        while self.jumped:
            try:
                clock = self.jumped.popleft()
            except IndexError:  # Another thread was faster.
                return
            for follower in tuple(clock.followers):
                follower.rearm()

    def _drop_replaced(self) -> None:
        self._heap = [entry for entry in self._heap if entry[-1] is not None]
        heapq.heapify(self._heap)
        self._heap_limit = max(_MIN_HEAP_LIMIT, 2 * len(self._heap))


class DelayedCall:
    """Calls a function once, after a delay."""

    def __init__(
        self, deadlines: Deadlines, delay_sec: float, function: Callable[[], Any]
    ) -> None:
        self.deadline_ns: int | None = None
        self._deadlines = deadlines
        self._function = function
        deadlines.set(self, monotonic_ns() + int(delay_sec * 1e9))

    def cancel(self) -> None:
        """Do not call it, if that is still to come."""
        self._deadlines.set(self, None)

    def on_deadline(self) -> None:
        """Call the function."""
        self._function()
