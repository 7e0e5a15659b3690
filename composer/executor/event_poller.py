"""Where the middleware's events arrive: eventfds and a kernel timer in one epoll.

An eventfd is never closed, only reused for the next entity: if an entity is destroyed while
someone still uses it, the middleware may write to its eventfd once more, and that must never reach
a descriptor of somebody else. A stray event costs one take that finds nothing.
"""

import errno
import os
import resource
import select
import threading
from collections.abc import Callable
from contextlib import suppress
from threading import get_ident
from typing import Protocol

from composer.executor.after_fork import replace_descriptors
from composer.executor.c_bindings import (
    peek_epoll,
    read_eventfd,
    wait_readable,
    write_eventfd,
)
from composer.executor.deadlines import Deadlines

_MAX_EVENTS = 512
_FDS_LEFT_TO_OTHERS = 64

UNKNOWN_COUNT = 1 << 62
"""A number of events that means: take until there is nothing left."""


class Listener(Protocol):
    """What events are for; of several that came together, the one of the least `rank` is first."""

    rank: int

    def on_events(self, count: int) -> None:
        """Note that `count` events came; the count may be too high, never too low."""


class _SpareEventFds:
    """The process's eventfds that no entity uses."""

    def __init__(self) -> None:
        self._spare: list[int] = []
        os.register_at_fork(after_in_child=self._spare.clear)

    def get(self, left_to_others: int) -> int:
        """Return an eventfd.

        Raises:
            OSError: The process may have no more descriptors, or only so many that are left to
                others.
        """
        try:
            return self._spare.pop()
        except IndexError:
            pass
        try:
            fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        except OSError as error:
            if error.errno != errno.EMFILE or not _raise_descriptor_limit():
                raise
            return self.get(left_to_others)
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        if fd < soft - left_to_others or _raise_descriptor_limit():
            return fd
        os.close(fd)
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    def put(self, fd: int) -> None:
        """Keep `fd` for the next entity."""
        self._spare.append(fd)


def _raise_descriptor_limit() -> bool:
    """Let the process have as many descriptors as it may; returns whether these are more."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    return soft < hard


_spare_event_fds = _SpareEventFds()


class EventFd:
    """An eventfd to which the middleware writes, and its listeners."""

    def __init__(self, fd: int, rank: int) -> None:
        self.fd = fd
        self.rank = rank
        self.listeners: list[Listener] = []

    def read(self) -> None:
        """Reset the count of events and pass it to the listeners."""
        count = read_eventfd(self.fd)
        listeners = self.listeners
        if not count:
            return
        if len(listeners) == 1:
            listeners[0].on_events(count)
        else:
            for listener in tuple(listeners):
                listener.on_events(UNKNOWN_COUNT)


class EventPoller:
    """Waits for events and deadlines, at a cost that depends only on how many have come.

    All listeners have been called when `peek` or `wait_if` returns.
    """

    def __init__(self) -> None:
        self._epoll = select.epoll()
        self._lock = threading.Lock()
        self._event_fds: dict[int, EventFd] = {}
        self._waiting_threads: set[int] = set()
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._epoll.register(self._wake_fd, select.EPOLLIN)
        self.deadlines = Deadlines(self.wake)
        self._epoll.register(self.deadlines.timer.fd, select.EPOLLIN)

    def __del__(self) -> None:
        with suppress(AttributeError):  # `__init__` may have failed half-way.
            self.close()

    def attach(self, listener: Listener, shared: EventFd | None = None) -> EventFd:
        """Give `listener` an eventfd of its own, or a place at `shared`.

        When the process has few descriptors left, an existing one is shared: slow but right.
        """
        with self._lock:
            if shared is None:
                try:
                    left_to_others = _FDS_LEFT_TO_OTHERS if self._event_fds else 0
                    shared = EventFd(_spare_event_fds.get(left_to_others), listener.rank)
                except OSError:
                    if not self._event_fds:
                        raise
                    shared = min(self._event_fds.values(), key=lambda fd: len(fd.listeners))
            shared.listeners.append(listener)
            if shared.fd not in self._event_fds:
                self._event_fds[shared.fd] = shared
                self._epoll.register(shared.fd, select.EPOLLIN)
            return shared

    def detach(self, listener: Listener, event_fd: EventFd) -> None:
        """Remove `listener`; without listeners, the descriptor is free for the next entity."""
        with self._lock:
            event_fd.listeners.remove(listener)
            if not event_fd.listeners and self._event_fds.pop(event_fd.fd, None) is not None:
                self._epoll.unregister(event_fd.fd)
                _spare_event_fds.put(event_fd.fd)

    def wake(self) -> None:
        """Make the threads that wait look again."""
        if self._waiting_threads:
            write_eventfd(self._wake_fd)

    def peek(self) -> bool:
        """Look for events, at once and without releasing the GIL; returns whether any came."""
        arrived = peek_epoll(self._epoll.fileno())
        self._dispatch(arrived)
        if arrived:
            # A wake-up for the leader may have been among them: a former leader looks here too.
            self.wake()
        self.deadlines.rearm_after_jumps()
        return bool(arrived)

    def wait_if(self, is_idle: Callable[[], bool], timeout_sec: float | None) -> None:
        """Wait for events if `is_idle()`, else only look; a timeout of None is for ever.

        Whoever makes `is_idle()` false meanwhile calls `wake`.
        """
        me = get_ident()
        self._waiting_threads.add(me)
        try:
            arrived = self._wait(timeout_sec if is_idle() else 0)
        finally:
            self._waiting_threads.discard(me)
        self._dispatch(arrived)
        self.deadlines.rearm_after_jumps()

    def _wait(self, timeout_sec: float | None) -> list[tuple[int, int]]:
        if timeout_sec:
            wait_readable(self._epoll.fileno(), timeout_sec)
            timeout_sec = 0
        return self._epoll.poll(timeout_sec, _MAX_EVENTS)

    def _dispatch(self, arrived: list[tuple[int, int]]) -> None:
        if len(arrived) > 1:
            arrived.sort(key=self._rank)
        for fd, _ in arrived:
            event_fd = self._event_fds.get(fd)
            if event_fd is not None:
                event_fd.read()
            elif fd == self._wake_fd:
                read_eventfd(fd)
            elif fd == self.deadlines.timer.fd:  # Any other was detached since it came.
                self.deadlines.run_due()

    def _rank(self, event: tuple[int, int]) -> int:
        event_fd = self._event_fds.get(event[0])
        return 0 if event_fd is None else event_fd.rank

    def reset_after_fork(self) -> None:
        """Replace the descriptors shared with the parent process; the new ones are silent."""
        self._waiting_threads.clear()
        self.deadlines.timer.reset_after_fork()
        if self._epoll.closed:
            return
        eventfd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        replace_descriptors((self._wake_fd, *self._event_fds), eventfd)
        os.close(eventfd)
        with select.epoll() as epoll:
            replace_descriptors((self._epoll.fileno(),), epoll.fileno())
        self._event_fds.clear()

    def close(self) -> None:
        """Close the descriptors; nothing else may be called after that."""
        with self._lock:
            if self._epoll.closed:
                return
            for fd in self._event_fds:
                self._epoll.unregister(fd)
                _spare_event_fds.put(fd)
            self._event_fds.clear()
            self._epoll.close()
            os.close(self._wake_fd)
        self.deadlines.timer.close()
