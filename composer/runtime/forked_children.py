"""Child processes that a behaviour forks: they never go on as a second copy of the system.

Only the thread that forked lives on in the child, which shares its sockets and files with the
system. A behaviour may do there what it likes, but when it returns, the child ends.
"""

from __future__ import annotations

import os
import signal
import threading
from contextlib import suppress
from typing import Any

from composer.executor.after_fork import flush_output

# Whether this process is such a child.
in_child = False

# The handlers that a child restores, by the numbers of their signals.
signal_handlers: dict[int, Any] = {}

# The signal mask of the thread that forks.
_fork = threading.local()


def _prepare() -> None:
    # Else the child would write the system's buffers, too.
    flush_output()
    # Signals wait until the child has its own handlers.
    _fork.mask = signal.pthread_sigmask(signal.SIG_BLOCK, signal_handlers)


def _restore_mask() -> None:
    signal.pthread_sigmask(signal.SIG_SETMASK, _fork.mask)


def _start_child() -> None:
    global in_child  # noqa: PLW0603 - it is a fact of the whole process
    in_child = True
    with suppress(ValueError):
        # The signals of the child are none of the guardian's business.
        signal.set_wakeup_fd(-1)
    for number, handler in signal_handlers.items():
        with suppress(ValueError, TypeError):
            signal.signal(number, handler)
    _restore_mask()
    _become_main_thread()


def _become_main_thread() -> None:
    """Set up the main thread, which Python forgets if the forking thread is not its own.

    Without this, `multiprocessing` ends its children with exit code 1
    (https://github.com/python/cpython/issues/102512, fixed in 3.12.3).
    """
    thread: Any = threading.main_thread()
    if getattr(thread, '_tstate_lock', thread) is None:
        thread._set_tstate_lock()  # noqa: SLF001 - as Python itself does since


os.register_at_fork(before=_prepare, after_in_parent=_restore_mask, after_in_child=_start_child)
