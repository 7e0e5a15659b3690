"""Threads and processes that simulated threads start.

The threads take turns, too. A process takes no virtual time: who waits for it really waits, and
nobody else runs meanwhile.
"""

from __future__ import annotations

import subprocess
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

from composer.virtual_time.clocks import to_ns

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.virtual_time.simulated_threads import SimulatedThreads


def thread_methods(
    threads: SimulatedThreads, on_start: Callable[[], None]
) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the methods of `threading.Thread` that are others, by their names.

    Args:
        on_start: Called when a simulated thread starts another.
    """
    start, join, is_alive = (
        threading.Thread.start,
        threading.Thread.join,
        threading.Thread.is_alive,
    )
    bootstrap: Any = threading.Thread._bootstrap_inner  # type: ignore[attr-defined]  # noqa: SLF001

    def start_in_turn(self: Any) -> None:
        if threads.mine() is not None and not self._started.is_set():
            on_start()
            with threads.added(partial(bootstrap, self)) as self._simulated:
                start(self)
        else:
            start(self)

    def bootstrap_in_turn(self: Any) -> None:
        simulated = getattr(self, '_simulated', None)
        if simulated is None:
            bootstrap(self)
        else:
            report = self._invoke_excepthook
            # What comes of the end of the simulation is no error of the thread.
            self._invoke_excepthook = lambda who: simulated.is_ending or report(who)
            threads.run(simulated)

    def join_in_turn(self: Any, timeout: Any = None) -> None:
        simulated = getattr(self, '_simulated', None)
        if simulated is None or threads.mine() is None or threads.mine() is simulated:
            join(self, timeout)
            return
        limit_ns = None if timeout is None else to_ns(max(timeout, 0))
        is_over = simulated.is_over or threads.wait_until(lambda: simulated.is_over, limit_ns)
        if is_over:
            # Its last steps, in C, take no turns.
            with threads.outside():
                join(self)

    def is_alive_in_turn(self: Any) -> bool:
        simulated = getattr(self, '_simulated', None)
        if simulated is not None and simulated.is_over and threads.mine() is not None:
            with threads.outside():
                join(self)
        return is_alive(self)

    yield from (
        ('start', start_in_turn),
        ('join', join_in_turn),
        ('is_alive', is_alive_in_turn),
        ('_bootstrap_inner', bootstrap_in_turn),
    )


def process_methods(threads: SimulatedThreads) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the methods of `subprocess.Popen` that are others, by their names."""
    for name in ('communicate', 'wait'):
        yield name, _really(threads, getattr(subprocess.Popen, name))


def _really(threads: SimulatedThreads, method: Callable[..., Any]) -> Callable[..., Any]:
    def wait(*arguments: Any, **keywords: Any) -> Any:
        with threads.outside():
            return method(*arguments, **keywords)

    return wait
