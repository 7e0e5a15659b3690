"""What a system needs of Linux, tried once before it starts.

Sandboxes and old kernels refuse some calls, and containers limit the number of threads: later,
that would be an error of a library, or a process that waits for ever.
"""

from __future__ import annotations

import os
import resource
import select
import signal
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from composer.errors import StartError
from composer.processes.guardian import RLIMIT_LOCKS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

# Threads, of which processes have one each, that a system of one node starts beside those of its
# imports, of Composer and of Fast DDS; those of a worker; and what keeps all workers, or all
# external processes.
SYSTEM_THREADS = 26
WORKER_THREADS = 27
WORKER_KEEPER_THREADS = 6
PROCESS_KEEPER_THREADS = 3
# Those of commands that ask a system, or record its topics.
CLIENT_THREADS = 11
# Those of the process of cases, and of a case.
CASE_THREADS = 14


def _try_pidfd() -> None:
    process = os.pidfd_open(os.getpid())
    try:
        signal.pidfd_send_signal(process, 0)
    finally:
        os.close(process)


def _try_limits() -> None:
    resource.setrlimit(RLIMIT_LOCKS, resource.getrlimit(RLIMIT_LOCKS))


_NEEDS: Mapping[str, Callable[[], object]] = {
    '/proc': lambda: next(Path('/proc/self/fd').iterdir()),
    'pidfd_open and pidfd_send_signal': _try_pidfd,
    'eventfd': lambda: os.close(os.eventfd(0)),
    'epoll': lambda: select.epoll().close(),
    'prlimit': _try_limits,
}


def check_kernel() -> None:
    """Check that this kernel, and a sandbox in it, have what systems need.

    Raises:
        StartError: They lack something.
    """
    for name, attempt in _NEEDS.items():
        try:
            attempt()
        except (OSError, AttributeError) as error:
            reason = error.strerror if isinstance(error, OSError) else 'this Python lacks it'
            message = f'systems cannot run here without {name}: {reason}'
            advice = 'Composer needs Linux 5.3 or later, and a sandbox that allows this'
            raise StartError(message, help=advice) from error


def check_threads(count: int) -> None:
    """Check that so many more threads, or processes, can be started.

    Raises:
        StartError: They cannot.
    """
    is_over = threading.Event()
    threads = [threading.Thread(target=is_over.wait, daemon=True) for _ in range(count)]
    started = 0
    try:
        for thread in threads:
            thread.start()
            started += 1
    except RuntimeError as error:
        message = f'{count} more threads are needed, and only {started} can be started'
        raise StartError(message, help=THREADS_HELP) from error
    finally:
        is_over.set()
        for thread in threads[:started]:
            thread.join()


THREADS_HELP = (
    'raise the limit: --pids-limit of the container, TasksMax= of the unit, or ulimit -u or -v'
)
