"""A thread that checks the system periodically."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from composer.runtime.behaviours.error_reports import ErrorReporter
from composer.runtime.behaviours.tracebacks import format_internal_error
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable


class Watcher:
    """Calls a function periodically, whatever it raises; its errors are logged as those of others.

    Args:
        name: The name of the thread.
        check: Called from `start` to `stop`.
        pause_sec: The time between two calls.
    """

    def __init__(self, name: str, check: Callable[[], None], pause_sec: float) -> None:
        self._check = check
        self._pause_sec = pause_sec
        self._ended = threading.Event()
        self._reporter = ErrorReporter(system_logger.error)
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Start to check."""
        self._thread.start()

    def stop(self) -> None:
        """Stop to check, and wait for a running check for up to one pause."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join(self._pause_sec)

    def _run(self) -> None:
        while not self._ended.wait(self._pause_sec):
            try:
                self._check()
            except Exception as error:  # noqa: BLE001 - one error must not end the checks
                self._reporter.report(self._thread.name, error, format_internal_error)
