"""The eventfds to which the middleware writes when an entity has something to take.

A process has few descriptors, and `select` serves only the first 1,024. So entities that are
seldom busy share an eventfd, up to 32 of a kind: its event may be for any of them, and has all of
them looked at. Others have one of their own, whose event costs the same beside any number of
entities; there are at most 384. One that shares and is busy gets its own, if need be in the place
of one that has been silent.

An eventfd is closed when no entity can write to it any more: the middleware may write once more
for one that is destroyed while someone still uses it, and must not reach a descriptor of somebody
else.
"""

import os
import resource
import select
import threading
from collections import defaultdict, deque
from contextlib import suppress
from time import monotonic
from typing import Protocol

from rclpy.exceptions import InvalidHandle

from composer.executor.descriptors import EPOLL, ExecutorError, LostDescriptorError, read_eventfd

UNKNOWN_COUNT = 1 << 62
"""A number of events that means: take until there is nothing left."""

_MAX_SHARING = 32
_MAX_DESCRIPTORS = 1024
_MAX_OWN_SHARE = 3 / 8
_MOVE_INTERVAL_SEC = 0.01
_MAX_LOOKED_AT = 8


class Listener(Protocol):
    """What an eventfd is for.

    Attributes:
        rank: Of several that have events at the same time, the one of the least rank is first.
        has_own_event_fd: Whether it should have an eventfd of its own before it was ever busy.
        event_fd: Its eventfd while it listens.
    """

    rank: int
    has_own_event_fd: bool
    event_fd: 'EventFd | None'

    def watch(self, fd: int | None) -> None:
        """Have the middleware add to the eventfd `fd` from now on; None for nowhere.

        Raises:
            InvalidHandle: The entity is destroyed, or will be when nobody uses it any more.
            ExecutorError: The middleware cannot do it.
        """

    def is_gone(self) -> bool:
        """Tell whether the middleware writes nowhere any more, because nothing is left of it."""

    def on_events(self, count: int) -> None:
        """Note that `count` events came; the count may be too high, never too low."""


class EventFd:
    """An eventfd and its listeners.

    Attributes:
        is_shared: Whether there may be several listeners; each is told of the events of all.
        is_lost: Whether the descriptor may be somebody else's, who has closed or replaced it.
        was_used: Whether events have come since it was last looked at.
    """

    def __init__(self, rank: int, *, is_shared: bool) -> None:
        self.fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self.rank = rank
        self.is_shared = is_shared
        self.is_lost = False
        self.was_used = True
        self.listeners: list[Listener] = []
        self._leaving: list[Listener] = []

    def read(self) -> None:
        """Reset the count of events and pass it to the listeners."""
        count = read_eventfd(self.fd)
        if not count:
            return
        self.was_used = True
        if self.is_shared:
            for listener in tuple(self.listeners):
                listener.on_events(count)
        else:
            for listener in self.listeners:  # One, or none any more.
                listener.on_events(count)
                break

    def remove(self, listener: Listener) -> None:
        """Have the middleware write no more for `listener`, if it can still be told."""
        self._forget_gone()
        try:
            listener.watch(None)
        except (InvalidHandle, ExecutorError):
            self._leaving.append(listener)
        self.listeners.remove(listener)

    def is_unused(self) -> bool:
        """Tell whether nobody listens and the middleware writes nothing to it any more."""
        self._forget_gone()
        return not (self.listeners or self._leaving)

    def _forget_gone(self) -> None:
        self._leaving = [listener for listener in self._leaving if not listener.is_gone()]


class _OwnEventFds:
    """How many eventfds of the process serve one entity each."""

    def __init__(self) -> None:
        self._count = 0
        self._lock = threading.Lock()
        os.register_at_fork(after_in_child=self._reset_lock)

    def add(self) -> bool:
        """Count one more; returns False if the process has all that it may have."""
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        usable = _MAX_DESCRIPTORS if soft < 0 else min(soft, _MAX_DESCRIPTORS)
        with self._lock:
            if self._count >= int(usable * _MAX_OWN_SHARE):
                return False
            self._count += 1
            return True

    def remove(self) -> None:
        """Count one less."""
        with self._lock:
            self._count -= 1

    def _reset_lock(self) -> None:
        self._lock = threading.Lock()  # Another thread may have held it, and is not in the child.


_own_event_fds = _OwnEventFds()


def check_watched(epoll: select.epoll, fd: int, what: str) -> None:
    """Check that `epoll` still watches what it was given as `fd`.

    Raises:
        LostDescriptorError: Somebody has closed or replaced one of the two.
    """
    try:
        epoll.modify(fd, select.EPOLLIN)
    except OSError as error:
        raise LostDescriptorError(what, fd) from error


class EventFds:
    """The eventfds of one executor.

    Args:
        epoll: Watches them.

    Attributes:
        by_number: The eventfds by their descriptors.
        lock: Held while listeners come, go and move.
    """

    def __init__(self, epoll: select.epoll) -> None:
        self.by_number: dict[int, EventFd] = {}
        self.lock = threading.Lock()
        self._epoll = epoll
        self._own: deque[EventFd] = deque()
        self._shared: defaultdict[int, list[EventFd]] = defaultdict(list)
        self._left: list[EventFd] = []
        self._next_move = 0.0

    def attach(self, listener: Listener) -> None:
        """Have the middleware tell `listener` of its events.

        Raises:
            InvalidHandle, ExecutorError: As `Listener.watch`.
            OSError: The process may have no more descriptors, and this has none to share.
        """
        with self.lock:
            self._close_left()
            self._place(listener, has_own=listener.has_own_event_fd)

    def detach(self, listener: Listener) -> None:
        """Undo `attach`."""
        with self.lock:
            event_fd, listener.event_fd = listener.event_fd, None
            if event_fd is not None:
                event_fd.remove(listener)
                self._leave(event_fd)

    def note_busy(self, listener: Listener) -> None:
        """Give `listener`, which shares an eventfd and had something to take, its own.

        This happens so seldom that it costs nothing if more are busy than can have their own.
        """
        now = monotonic()
        if now < self._next_move or not self.lock.acquire(blocking=False):
            return
        silent = None
        try:
            self._next_move = now + _MOVE_INTERVAL_SEC
            if listener.event_fd is None or not listener.event_fd.is_shared:
                return
            with suppress(InvalidHandle, ExecutorError):
                silent = self._have_silent_share()
                self._place(listener, has_own=True)
        finally:
            self.lock.release()
        # What came while they moved may have been read with the eventfds that they left.
        listener.on_events(UNKNOWN_COUNT)
        if silent is not None:
            silent.on_events(UNKNOWN_COUNT)

    def check(self) -> None:
        """Check that nobody has closed or replaced one.

        Raises:
            LostDescriptorError: Somebody has.
        """
        if self.lock.acquire(blocking=False):
            try:
                for fd in self.by_number:
                    check_watched(self._epoll, fd, 'an eventfd')
            finally:
                self.lock.release()

    def close(self) -> None:
        """Close those that nobody can write to any more."""
        with self.lock:
            for event_fd in tuple(self.by_number.values()):
                self._leave(event_fd)
            self._close_left()

    def _place(self, listener: Listener, *, has_own: bool) -> None:
        """Move `listener` from its eventfd, if it has one, to another."""
        before = listener.event_fd
        event_fd = self._create_own(listener.rank) if has_own else None
        if event_fd is None:
            if before is not None and before.is_shared:
                return
            event_fd = self._find_shared(listener.rank)
        event_fd.listeners.append(listener)
        listener.event_fd = event_fd
        try:
            listener.watch(event_fd.fd)
        except BaseException:
            event_fd.listeners.remove(listener)
            listener.event_fd = before
            self._leave(event_fd)
            raise
        if before is not None:
            before.listeners.remove(listener)
            self._leave(before)

    def _have_silent_share(self) -> Listener | None:
        """Have one that has been silent share an eventfd, if no more can have their own."""
        if _own_event_fds.add():
            _own_event_fds.remove()
            return None
        for _ in range(min(len(self._own), _MAX_LOOKED_AT)):
            event_fd = self._own[0]
            self._own.rotate(-1)
            if event_fd.was_used:
                event_fd.was_used = False
            else:
                silent = event_fd.listeners[0]
                self._place(silent, has_own=False)
                return silent
        return None

    def _create_own(self, rank: int) -> EventFd | None:
        if not _own_event_fds.add():
            return None
        try:
            event_fd = self._create(rank, is_shared=False)
        except OSError:
            _own_event_fds.remove()
            return None
        self._own.append(event_fd)
        return event_fd

    def _find_shared(self, rank: int) -> EventFd:
        shared = self._shared[rank]
        for event_fd in reversed(shared):
            if len(event_fd.listeners) < _MAX_SHARING:
                return event_fd
        try:
            event_fd = self._create(rank, is_shared=True)
        except OSError:
            if not self.by_number:
                raise
            # Without descriptors, any is shared: slow for its listeners, but none is deaf.
            event_fd = min(self.by_number.values(), key=lambda event_fd: len(event_fd.listeners))
            if event_fd.is_shared:
                return event_fd
            event_fd.is_shared = True
            self._own.remove(event_fd)
            _own_event_fds.remove()
        shared.append(event_fd)
        return event_fd

    def _create(self, rank: int, *, is_shared: bool) -> EventFd:
        event_fd = EventFd(rank, is_shared=is_shared)
        try:
            self._epoll.register(event_fd.fd, select.EPOLLIN)
        except OSError as error:
            os.close(event_fd.fd)
            raise LostDescriptorError(EPOLL, self._epoll.fileno()) from error
        self.by_number[event_fd.fd] = event_fd
        return event_fd

    def _leave(self, event_fd: EventFd) -> None:
        """Close `event_fd`, or put it aside until nobody can write to it, if nobody listens."""
        if event_fd.listeners or self.by_number.pop(event_fd.fd, None) is None:
            return
        try:
            self._epoll.unregister(event_fd.fd)
        except OSError:
            event_fd.is_lost = True
        if event_fd.is_shared:
            for shared in self._shared.values():
                if event_fd in shared:
                    shared.remove(event_fd)
        else:
            self._own.remove(event_fd)
            _own_event_fds.remove()
        self._left.append(event_fd)
        self._close_left()

    def _close_left(self) -> None:
        left, self._left = self._left, []
        for event_fd in left:
            if not event_fd.is_unused():
                self._left.append(event_fd)
            elif not event_fd.is_lost:
                os.close(event_fd.fd)
