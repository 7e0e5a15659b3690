"""Asks workers whether they still run Python, and tells which does not."""

from __future__ import annotations

import threading
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from composer.runtime.workers.worker import Worker
    from composer.terminal import EscapingLogger

_PERIOD_SEC = 1.0
_SILENT_SEC = 5.0
# It prints stacks, at most, which may take as long as nobody reads them.
_JOIN_SEC = 1.0


class WorkerWatch:
    """A thread that asks all workers, from `start` to `stop`.

    Args:
        list_workers: Returns those that there are.
    """

    def __init__(self, list_workers: Callable[[], Iterable[Worker]], log: EscapingLogger) -> None:
        self._list_workers = list_workers
        self._log = log
        # Those that have not answered yet, and since when.
        self._asked: dict[Worker, float] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name='worker-watch', daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def stop(self) -> None:
        """Ask no more, and wait until the thread has ended."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join(_JOIN_SEC)

    def _run(self) -> None:
        while not self._ended.wait(_PERIOD_SEC):
            for worker in self._list_workers():
                if worker.is_alive and worker.has_imported:
                    self._look(worker)

    def _look(self, worker: Worker) -> None:
        asked = self._asked.get(worker)
        is_silent = asked is not None and monotonic() - asked > _SILENT_SEC
        if asked is None:
            self._asked[worker] = monotonic()
            threading.Thread(target=self._ask, args=(worker,), daemon=True).start()
        if is_silent and not worker.is_silent:
            self._log.error(
                f"worker '{worker.name}' has not answered for {_SILENT_SEC:g} s: it was stopped, "
                'or a behaviour keeps the interpreter from all others; its threads are at'
            )
            worker.print_stacks()
            worker.is_silent = True

    def _ask(self, worker: Worker) -> None:
        with suppress(ComposerError):
            worker.call('ping')
            if worker.is_silent and not self._ended.is_set():
                self._log.info(f"worker '{worker.name}' answers again")
        worker.is_silent = False
        self._asked.pop(worker, None)
