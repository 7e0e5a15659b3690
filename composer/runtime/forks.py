"""A child that a behaviour forks never goes on as a second copy of the system.

Only the thread that forked lives in the child, and sockets and files are shared with the system.
What a behaviour does there is its own business, but when it returns, the child ends.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.executor.after_fork import end_child

if TYPE_CHECKING:
    from types import CodeType, FrameType

# Whether this process is such a child.
in_child = False

# What a child does at signals, by their numbers: what was done before the system took them.
signal_handlers: dict[int, Any] = {}

# The mask of signals of a thread that forks.
_forking = threading.local()

# The code of coroutines that run behaviours.
coroutine_codes: set[CodeType] = set()


def flush_output() -> None:
    """Write what is in the buffers, if there is still somewhere to write it."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()


def _prepare() -> None:
    # What is in the buffers is the system's to write, not the child's again.
    flush_output()
    # A signal that comes to the child before it has its own handlers must wait for them.
    _forking.mask = signal.pthread_sigmask(signal.SIG_BLOCK, signal_handlers)


def _go_on() -> None:
    signal.pthread_sigmask(signal.SIG_SETMASK, _forking.mask)


def _begin_child() -> None:
    global in_child  # noqa: PLW0603 - it is a fact about the process
    in_child = True
    for number, handler in signal_handlers.items():
        with suppress(ValueError, TypeError):
            signal.signal(number, handler)
    _go_on()
    _become_main_thread()
    frame: FrameType | None = sys._getframe()  # noqa: SLF001 - the only way
    while frame is not None and frame.f_code not in coroutine_codes:
        frame = frame.f_back
    if frame is not None:
        _leave_at_end_of(frame)


def _become_main_thread() -> None:
    """Do what Python forgets for a thread that it did not start itself.

    Without it `multiprocessing` ends its children with exit code 1
    (https://github.com/python/cpython/issues/102512, mended in 3.12.3).
    """
    thread: Any = threading.main_thread()
    if getattr(thread, '_tstate_lock', thread) is None:
        thread._set_tstate_lock()  # noqa: SLF001 - as Python itself does since


def _leave_at_end_of(coroutine: FrameType) -> None:
    """End the child when a coroutine gives control back, be it only because it awaits."""

    def look(frame: FrameType, event: str, _argument: object) -> None:
        if event == 'return' and frame is coroutine:
            end_child()

    sys.setprofile(look)


os.register_at_fork(before=_prepare, after_in_parent=_go_on, after_in_child=_begin_child)
