"""The order in which accepted goals run, as `concurrency` says."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import Concurrency


class GoalQueue:
    """The goals of one action that run or wait.

    Args:
        start: Begins to execute a goal; `finished` is called when it has ended.

    Attributes:
        concurrency: What becomes of goals that come while one runs.
        is_closed: Whether no more goals are accepted.
        aborts: Whether those that run are to end.
    """

    def __init__(self, concurrency: Concurrency, start: Callable[[Any], None]) -> None:
        self.concurrency = concurrency
        self.is_closed = False
        self.aborts = False
        self._start = start
        self._running: dict[bytes, Any] = {}
        self._waiting: deque[Any] = deque()
        self._superseded: set[bytes] = set()
        self._lock = threading.Lock()

    def has_room(self) -> bool:
        """Return whether another goal may be accepted now."""
        with self._lock:
            return not self.is_closed and (self.concurrency != 'reject' or not self._running)

    def add(self, goal: Any) -> None:
        """Run an accepted goal now or later."""
        superseded: list[Any] = []
        with self._lock:
            waits = bool(self._running) and self.concurrency in ('queue', 'preempt')
            if self.concurrency == 'preempt':
                self._superseded.update(self._running)
                superseded = list(self._waiting)
                self._waiting.clear()
                self._superseded.update(goal_key(other) for other in superseded)
            if waits:
                self._waiting.append(goal)
            else:
                self._running[goal_key(goal)] = goal
        for other in superseded:
            # It never ran: executing it only gives it its final state.
            self._start(other)
        if not waits:
            self._start(goal)

    def is_superseded(self, goal: Any) -> bool:
        """Return whether a newer goal has taken this one's place."""
        return goal_key(goal) in self._superseded

    def take_out(self, goal: Any) -> bool:
        """Remove a goal that waits; return whether it was waiting."""
        with self._lock:
            if goal not in self._waiting:
                return False
            self._waiting.remove(goal)
            return True

    def finished(self, goal: Any) -> None:
        """Remove a goal that has ended, and start the one that waited for it."""
        following = None
        with self._lock:
            was_running = self._running.pop(goal_key(goal), None) is not None
            self._superseded.discard(goal_key(goal))
            if was_running and self._waiting and not self._running:
                following = self._waiting.popleft()
                self._running[goal_key(following)] = following
        if following is not None:
            self._start(following)


def goal_key(goal: Any) -> bytes:
    """Return the identifier of a goal handle, which is not hashable itself."""
    return bytes(goal.goal_id.uuid)
