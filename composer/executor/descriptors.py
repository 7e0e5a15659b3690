"""File descriptors of Linux that announce something: eventfds, epolls and timers.

What Python does not offer, or only with the GIL released, is called through ctypes.
"""

import ctypes
import os
from time import monotonic_ns
from typing import Any

from composer.errors import ComposerError

_libc = ctypes.CDLL(None, use_errno=True)
_libc_holding_gil = ctypes.PyDLL(None)


class ExecutorError(ComposerError):
    """The middleware or the system lacks what the executor needs."""


class LostDescriptorError(ExecutorError):
    """Somebody closed or replaced a file descriptor of the executor, which cannot go on."""

    def __init__(self, what: str, fd: int) -> None:
        advice = 'close only what you opened: os.close and os.dup2 ask nobody whose it is'
        message = f'file descriptor {fd}, {what} of the executor, was closed or replaced'
        super().__init__(message, help=advice)


# Eventfds

_libc_holding_gil.eventfd_write.argtypes = (ctypes.c_int, ctypes.c_uint64)
_eventfd_read = _libc_holding_gil.eventfd_read
_EventCount = ctypes.c_uint64 * 1
_spare_counts: list[Any] = []  # A new one is made only when several threads read at once.


def write_eventfd(fd: int) -> None:
    """Add one to an eventfd, without releasing the GIL."""
    _libc_holding_gil.eventfd_write(fd, 1)


def read_eventfd(fd: int) -> int:
    """Return and reset the count of a non-blocking eventfd, without releasing the GIL.

    A thread that releases it beside a computing thread gets it back a switch interval later.
    """
    try:
        count = _spare_counts.pop()
    except IndexError:
        count = _EventCount()
    value: int = 0 if _eventfd_read(fd, count) else count[0]
    _spare_counts.append(count)
    return value


# Waiting


class _PollFd(ctypes.Structure):
    _fields_ = (('fd', ctypes.c_int), ('events', ctypes.c_short), ('revents', ctypes.c_short))


class _TimeSpec(ctypes.Structure):
    _fields_ = (('sec', ctypes.c_long), ('nsec', ctypes.c_long))


EPOLL = 'an epoll'
_MAX_EVENTS = 64
# An `epoll_event` in words of 32 bits: a set of flags, then the descriptor; packed only on x86-64.
_WORDS, _FD_WORD = (3, 1) if os.uname().machine == 'x86_64' else (4, 2)
_EpollEvents = ctypes.c_int32 * (_WORDS * _MAX_EVENTS)
_spare_events: list[Any] = []  # A new one is made only when several threads look at once.
_epoll_wait = _libc_holding_gil.epoll_wait
_POLLIN = 1
_libc.ppoll.argtypes = (
    ctypes.POINTER(_PollFd),
    ctypes.c_ulong,
    ctypes.POINTER(_TimeSpec),
    ctypes.c_void_p,
)


def peek_epoll(epoll_fd: int) -> list[int]:
    """Return the descriptors that are ready in an epoll, without releasing the GIL.

    Raises:
        LostDescriptorError: `epoll_fd` is no epoll.
    """
    try:
        found = _spare_events.pop()
    except IndexError:
        found = _EpollEvents()
    count = _epoll_wait(epoll_fd, found, _MAX_EVENTS, 0)
    if count < 0:
        raise LostDescriptorError(EPOLL, epoll_fd)
    arrived = found[_FD_WORD : count * _WORDS : _WORDS] if count else []
    _spare_events.append(found)
    return arrived


def wait_readable(fd: int, timeout_sec: float) -> None:
    """Wait until `fd` is readable, a POSIX signal comes, or exactly `timeout_sec` has passed.

    Python's own waits count in whole milliseconds and round up.
    """
    timeout = _TimeSpec(*divmod(int(timeout_sec * 1e9), 1_000_000_000))
    _libc.ppoll(ctypes.byref(_PollFd(fd, _POLLIN, 0)), 1, ctypes.byref(timeout), None)


# Timers


class _TimerSpec(ctypes.Structure):
    _fields_ = (
        ('interval_sec', ctypes.c_long),
        ('interval_nsec', ctypes.c_long),
        ('value_sec', ctypes.c_long),
        ('value_nsec', ctypes.c_long),
    )


TIMER = 'a timer'
_CLOCK_MONOTONIC = 1
_TFD_TIMER_ABSTIME = 1
_libc_holding_gil.timerfd_settime.argtypes = (
    ctypes.c_int,
    ctypes.c_int,
    ctypes.POINTER(_TimerSpec),
    ctypes.c_void_p,
)


class TimerFd:
    """A kernel timer on the monotonic clock that makes a file descriptor readable.

    To set it, or to wait for it, raises `LostDescriptorError` if somebody has closed it.
    """

    def __init__(self, *, blocking: bool) -> None:
        self._blocking = blocking
        self.fd = -1
        self.fd = self._create()

    def _create(self) -> int:
        flags = os.O_CLOEXEC if self._blocking else os.O_CLOEXEC | os.O_NONBLOCK
        fd: int = _libc.timerfd_create(_CLOCK_MONOTONIC, flags)
        if fd < 0:
            message = f'timerfd_create: {os.strerror(ctypes.get_errno())}'
            raise ExecutorError(message)
        return fd

    def expire_at(self, deadline_ns: int) -> None:
        """Expire once at `deadline_ns` of `time.monotonic_ns()`; at once if that has passed."""
        self._set(_TimerSpec(0, 0, *divmod(max(1, deadline_ns), 1_000_000_000)))

    def expire_in(self, delay_ns: int) -> None:
        """Expire once in `delay_ns`."""
        self.expire_at(monotonic_ns() + delay_ns)

    def disarm(self) -> None:
        """Do not expire."""
        self._set(_TimerSpec())

    def _set(self, spec: _TimerSpec) -> None:
        if _libc_holding_gil.timerfd_settime(
            self.fd, _TFD_TIMER_ABSTIME, ctypes.byref(spec), None
        ):
            raise LostDescriptorError(TIMER, self.fd)

    def read(self) -> None:
        """Wait for the expiry (if blocking) and forget it."""
        if self._blocking:
            try:
                os.read(self.fd, 8)
            except OSError as error:
                raise LostDescriptorError(TIMER, self.fd) from error
        else:
            read_eventfd(self.fd)  # Which reads eight bytes, as for a timer.

    def close(self) -> None:
        """Close the descriptor; nothing else may be called after that."""
        fd, self.fd = self.fd, -1
        # It may be somebody else's now, whom it would hurt to close it.
        if not _libc_holding_gil.timerfd_gettime(fd, ctypes.byref(_TimerSpec())):
            os.close(fd)

    def __del__(self) -> None:
        self.close()
