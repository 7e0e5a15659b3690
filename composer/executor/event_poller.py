"""Where the middleware's announcements arrive: eventfds in one epoll.

An eventfd is never closed, only passed on to the next entity: an entity that was destroyed while
someone still used it may be announced once more, and that must never reach a foreign descriptor.
A stray announcement costs one empty take.
"""

import errno
import os
import resource
import select
import threading
from typing import Protocol

from composer.executor.after_fork import lay_over
from composer.executor.c_bindings import (
    peek_epoll,
    read_eventfd,
    wait_readable,
    write_eventfd,
)

_MOST_EVENTS = 512
_LEFT_TO_OTHERS = 64


class Listener(Protocol):
    """What wants to hear of an announcement; of several at a time, the least `rank` first."""

    rank: int

    def on_signal(self, count: int) -> None:
        """Take note of `count` announcements; the count may be too high, never too low."""


UNKNOWN = 1 << 62
"""A count that means: take until there is nothing left."""


class _Descriptors:
    """The process's spare eventfds."""

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
            if error.errno != errno.EMFILE or not _raise_limit():
                raise
            return self.get(left_to_others)
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        if fd < soft - left_to_others or _raise_limit():
            return fd
        os.close(fd)
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    def put(self, fd: int) -> None:
        """Keep `fd` for the next entity."""
        self._spare.append(fd)


def _raise_limit() -> bool:
    """Let the process have as many descriptors as it may; returns whether these are more."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    return soft < hard


_descriptors = _Descriptors()


class Signal:
    """One eventfd and who listens to it."""

    def __init__(self, fd: int, rank: int) -> None:
        self.fd = fd
        self.rank = rank
        self.listeners: list[Listener] = []

    def on_signal(self) -> None:
        """Read the eventfd and tell the listeners."""
        count = read_eventfd(self.fd)
        listeners = self.listeners
        if not count:
            return
        if len(listeners) == 1:
            listeners[0].on_signal(count)
        else:
            for listener in tuple(listeners):
                listener.on_signal(UNKNOWN)


class SignalBoard:
    """Waits for signals, however many there are, at a cost that depends on those that came."""

    def __init__(self) -> None:
        self._epoll = select.epoll()
        self._lock = threading.Lock()
        self._signals: dict[int, Signal] = {}
        self._others: dict[int, Listener] = {}
        self._wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._epoll.register(self._wake_fd, select.EPOLLIN)

    def __del__(self) -> None:
        self.close()

    def attach(self, listener: Listener, shared: Signal | None = None) -> Signal:
        """Give `listener` a signal of its own, or a place at `shared`.

        When the process has few descriptors left, an existing signal is shared: slow but right.
        """
        with self._lock:
            if shared is None:
                try:
                    left_to_others = _LEFT_TO_OTHERS if self._signals else 0
                    shared = Signal(_descriptors.get(left_to_others), listener.rank)
                except OSError:
                    if not self._signals:
                        raise
                    shared = min(self._signals.values(), key=lambda s: len(s.listeners))
            shared.listeners.append(listener)
            if shared.fd not in self._signals:
                self._signals[shared.fd] = shared
                self._epoll.register(shared.fd, select.EPOLLIN)
            return shared

    def detach(self, listener: Listener, signal: Signal) -> None:
        """Take `listener` away; the last one gone frees the descriptor."""
        with self._lock:
            signal.listeners.remove(listener)
            if not signal.listeners and self._signals.pop(signal.fd, None) is not None:
                self._epoll.unregister(signal.fd)
                _descriptors.put(signal.fd)

    def add(self, fd: int, listener: Listener) -> None:
        """Tell `listener` whenever `fd` is readable."""
        self._others[fd] = listener
        self._epoll.register(fd, select.EPOLLIN)

    def wake(self) -> None:
        """Make the present or the next `wait` return at once."""
        write_eventfd(self._wake_fd)

    def wait(self, timeout_sec: float | None) -> list[tuple[int, int]]:
        """Wait for signals, for ever if `timeout_sec` is None; `deliver` is to follow."""
        if timeout_sec:
            wait_readable(self._epoll.fileno(), timeout_sec)
            timeout_sec = 0
        return self._epoll.poll(timeout_sec, _MOST_EVENTS)

    def peek(self) -> list[tuple[int, int]]:
        """Return the signals that have come, at once and without letting go of the GIL."""
        return peek_epoll(self._epoll.fileno())

    def deliver(self, arrived: list[tuple[int, int]]) -> None:
        """Tell the listeners of the signals that `wait` returned."""
        if len(arrived) > 1:
            arrived.sort(key=self._rank)
        for fd, _ in arrived:
            signal = self._signals.get(fd)
            if signal is not None:
                signal.on_signal()
            elif fd == self._wake_fd:
                read_eventfd(self._wake_fd)
            elif fd in self._others:  # Or it was detached since it came.
                self._others[fd].on_signal(1)

    def _rank(self, event: tuple[int, int]) -> int:
        signal = self._signals.get(event[0])
        return 0 if signal is None else signal.rank

    def leave_to_parent(self) -> None:
        """Have descriptors that the parent of this process has not; they say nothing."""
        if self._epoll.closed:
            return
        eventfd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        lay_over((self._wake_fd, *self._signals), eventfd)
        os.close(eventfd)
        with select.epoll() as epoll:
            lay_over((self._epoll.fileno(),), epoll.fileno())
        self._signals.clear()
        self._others.clear()

    def close(self) -> None:
        """Give back every descriptor; nothing else is called after that."""
        with self._lock:
            if self._epoll.closed:
                return
            for fd in self._signals:
                self._epoll.unregister(fd)
                _descriptors.put(fd)
            self._signals.clear()
            self._epoll.close()
            os.close(self._wake_fd)
