"""Where the middleware's events arrive: eventfds and a kernel timer in one epoll."""

import os
import select
import threading
from collections.abc import Callable
from contextlib import suppress
from threading import get_ident
from time import monotonic

from composer.executor.after_fork import replace_descriptors
from composer.executor.deadlines import Deadlines
from composer.executor.descriptors import (
    TIMER,
    LostDescriptorError,
    peek_epoll,
    read_eventfd,
    wait_readable,
    write_eventfd,
)
from composer.executor.event_fds import EventFds, check_watched

_CHECK_SEC = 1.0


class EventPoller:
    """Waits for events and deadlines, at a cost that depends only on how many have come.

    All listeners have been called when `peek` returns. It raises `LostDescriptorError` if somebody
    has closed or replaced a descriptor, a second later at most.

    Args:
        deadlines: Creates those of the executor, as `Deadlines` does.

    Attributes:
        waiting_threads: Those that wait.
    """

    def __init__(self, deadlines: Callable[[Callable[[], None]], Deadlines] = Deadlines) -> None:
        self._epoll = select.epoll()
        self.event_fds = EventFds(self._epoll)
        self.waiting_threads: set[int] = set()
        self._next_check = 0.0
        self._closing = threading.Lock()
        self.deadlines = deadlines(self.wake)
        # Last, for the others close themselves if there are no more descriptors.
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._epoll.register(self._wake_fd, select.EPOLLIN)
        self._epoll.register(self.deadlines.timer.fd, select.EPOLLIN)

    def __del__(self) -> None:
        # What still writes to it is let go of first; `__init__` may have failed half-way.
        with suppress(AttributeError):
            if not self.event_fds.by_number:
                self.close()

    def wake(self) -> None:
        """Make the threads that wait look again."""
        if self.waiting_threads:
            write_eventfd(self._wake_fd)

    def peek(self) -> bool:
        """Look for events, at once and without releasing the GIL; returns whether any came."""
        arrived = peek_epoll(self._epoll.fileno())
        if arrived:
            self._dispatch(arrived)
            if self.waiting_threads:
                # A wake-up for them may have been among these: a former leader looks here, too.
                self.wake()
        if self.deadlines.jumped:
            self.deadlines.rearm_after_jumps()
        if monotonic() >= self._next_check:
            self._check()
        return bool(arrived)

    def wait_if(self, is_idle: Callable[[], bool]) -> None:
        """Wait if `is_idle()` until there is something for `peek`, for at most a second.

        Whoever makes `is_idle()` false meanwhile calls `wake`.
        """
        self._wait_if(is_idle, self._epoll.fileno(), _CHECK_SEC)

    def wait_for_wake_if(self, is_idle: Callable[[], bool], timeout_sec: float) -> None:
        """Wait if `is_idle()` until `wake` is called or `timeout_sec` has passed."""
        self._wait_if(is_idle, self._wake_fd, timeout_sec)

    def _wait_if(self, is_idle: Callable[[], bool], fd: int, timeout_sec: float) -> None:
        me = get_ident()
        self.waiting_threads.add(me)
        try:
            if is_idle():
                wait_readable(fd, timeout_sec)
        finally:
            self.waiting_threads.discard(me)

    def _check(self) -> None:
        """Check that nobody has closed a descriptor: no event would come, and no word of it."""
        self._next_check = monotonic() + _CHECK_SEC
        with suppress(ValueError):  # The epoll is closed.
            check_watched(self._epoll, self._wake_fd, 'an eventfd')
            check_watched(self._epoll, self.deadlines.timer.fd, TIMER)
            self.event_fds.check()

    def _dispatch(self, arrived: list[int]) -> None:
        if len(arrived) > 1:
            arrived.sort(key=self._rank)
        for fd in arrived:
            event_fd = self.event_fds.by_number.get(fd)
            if event_fd is not None:
                event_fd.read()
            elif fd == self._wake_fd:
                read_eventfd(fd)
            elif fd == self.deadlines.timer.fd:  # Any other was detached since it came.
                self.deadlines.run_due()

    def _rank(self, fd: int) -> int:
        event_fd = self.event_fds.by_number.get(fd)
        return 0 if event_fd is None else event_fd.rank

    def leave_to_parent(self) -> None:
        """Close the descriptors that this process, a forked child, shares with its parent."""
        self.waiting_threads.clear()
        self.deadlines.timer.close()
        if self._epoll.closed:
            return
        silent = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        replace_descriptors(self.event_fds.by_number, silent)
        os.close(silent)
        self._epoll.close()
        wake_fd, self._wake_fd = self._wake_fd, -1
        os.close(wake_fd)

    def close(self) -> None:
        """Close the descriptors; nothing else may be called after that."""
        with self._closing:  # Another thread may do it, too.
            if not self._epoll.closed:
                self._close()

    def _close(self) -> None:
        try:
            self._check()
        except LostDescriptorError:
            # They may be somebody else's now, whom it would hurt to close them.
            _lost.append(self._epoll)
            self.deadlines.timer.close()
            return
        self.event_fds.close()
        self._epoll.close()
        wake_fd, self._wake_fd = self._wake_fd, -1
        os.close(wake_fd)
        self.deadlines.timer.close()


_lost: list[select.epoll] = []  # A finalizer would close it.
