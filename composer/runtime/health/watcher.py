"""A thread that looks at the system from time to time."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from composer.runtime.behaviours.tracebacks import format_internal_error
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable


class Watcher:
    """Calls a function at intervals, whatever it raises; the same fault is logged once.

    Args:
        name: That of the thread.
        look: Called from `start` to `stop`.
        pause_sec: Between two calls.
    """

    def __init__(self, name: str, look: Callable[[], None], pause_sec: float) -> None:
        self._look = look
        self._pause_sec = pause_sec
        self._ended = threading.Event()
        self._faults: set[str] = set()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Look no more; unless a look takes longer than a pause, none is on its way then."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join(self._pause_sec)

    def _run(self) -> None:
        while not self._ended.wait(self._pause_sec):
            try:
                self._look()
            except Exception as error:  # noqa: BLE001 - one fault must not leave the system unwatched
                self._report(format_internal_error(error))

    def _report(self, fault: str) -> None:
        if fault not in self._faults:
            self._faults.add(fault)
            system_logger.error(fault)
