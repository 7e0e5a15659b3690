"""How threads wait for events, and how they are told of more."""

from collections.abc import Callable
from threading import get_ident

from composer.executor.deadlines import Alarms
from composer.executor.event_poller import SignalBoard


class Polling:
    """Waits and looks for signals; what has come is announced before either returns."""

    def __init__(self) -> None:
        self.board = SignalBoard()
        self.alarms = Alarms(self.wake)
        self.board.add(self.alarms.timer.fd, self.alarms)
        self._pollers: set[int] = set()

    def wake(self) -> None:
        """Have those who wait look again."""
        if self._pollers:
            self.board.wake()

    def peek(self) -> bool:
        """Look for signals, without waiting; returns whether there were any."""
        arrived = self.board.peek()
        self.board.deliver(arrived)
        if arrived and self._pollers:
            # A wake-up for the leader may have been among it: whoever led before looks here too.
            self.board.wake()
        self.alarms.follow_jumps()
        return bool(arrived)

    def wait_if(self, has_nothing: Callable[[], bool], timeout_sec: float | None) -> None:
        """Wait for signals; whoever makes `has_nothing()` false meanwhile calls `wake`."""
        me = get_ident()
        self._pollers.add(me)
        try:
            arrived = self.board.wait(timeout_sec if has_nothing() else 0)
        finally:
            self._pollers.discard(me)
        self.board.deliver(arrived)
        self.alarms.follow_jumps()

    def leave_to_parent(self) -> None:
        """Hear nothing: this process was forked, and the signals are its parent's."""
        self._pollers.clear()
        self.board.leave_to_parent()
        self.alarms.timer.leave_to_parent()

    def close(self) -> None:
        """Give back every descriptor; nothing else is called after that."""
        self.board.close()
        self.alarms.timer.close()
