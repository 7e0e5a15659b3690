"""The server of cases: has imported everything, and forks a process for each case.

It reads requests from a connection, and answers each with the number and the result, in the order
in which they end. It ends, with all that it has started, when the connection closes.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import warnings
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection, wait
from time import monotonic
from typing import TYPE_CHECKING

from composer.scenarios.running.case_process import CaseProcess
from composer.scenarios.running.case_results import CaseFailure, CaseRequest, CaseResult
from composer.scenarios.running.warm_up import share_memory, warm_up

if TYPE_CHECKING:
    from composer.scenarios.running.prepared_case import PreparedFile


class CaseServer:
    """Runs the cases that are asked for.

    Args:
        connection: Where requests come from, as `(number, request)`; `None` ends the server.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._running: dict[int, tuple[int, CaseProcess]] = {}
        self._files: dict[str, PreparedFile] = {}

    def serve(self) -> None:
        """Run cases until the connection closes."""
        try:
            while self._handle_next():
                pass
        finally:
            for _, process in self._running.values():
                process.kill()

    def _handle_next(self) -> bool:
        """Handle what comes next; return whether there may be more."""
        descriptors = [self._connection.fileno(), *self._running]
        ready = wait(descriptors, self._next_limit())
        for descriptor in ready:
            if descriptor == self._connection.fileno():
                if not self._read_request():
                    return False
            elif isinstance(descriptor, int):
                self._end(descriptor)
        now = monotonic()
        for _, process in self._running.values():
            if process.kill_at < now:
                process.kill()
        return True

    def _next_limit(self) -> float | None:
        limits = [process.kill_at for _, process in self._running.values()]
        return max(0.01, min(limits) - monotonic()) if limits else None

    def _read_request(self) -> bool:
        try:
            asked = self._connection.recv()
        except (EOFError, OSError):
            return False
        if asked is None:
            return False
        number, request = asked
        try:
            self._start(number, request)
        except Exception as error:  # noqa: BLE001 - a broken case must not end those of others
            failure = CaseFailure('start', f'{type(error).__name__}: {error}')
            self._connection.send((number, CaseResult((failure,))))
        return True

    def _start(self, number: int, request: CaseRequest) -> None:
        from composer.scenarios.running.prepared_case import prepare_file

        if request.file not in self._files:
            self._files[request.file] = prepare_file(request.file)
            share_memory()
        file = self._files[request.file]
        limit_sec = request.real_time_limit_sec or file.limit_of(request.case)
        process = CaseProcess(partial(file.run, request), limit_sec, captures=request.captures)
        self._running[process.descriptor] = number, process

    def _end(self, descriptor: int) -> None:
        number, process = self._running.pop(descriptor)
        self._connection.send((number, process.end()))


def main(descriptor: int) -> None:
    """Serve the connection that this process was started with."""
    # The caller decides what Ctrl-C means; it closes the connection.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # As for a command; pytest leaves it as it was.
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    # Threads of C libraries, which live on in no child, are none that hold locks of Python.
    warnings.filterwarnings('ignore', 'This process .* is multi-threaded', DeprecationWarning)
    connection = Connection(descriptor)
    warm_up()
    share_memory()
    try:
        with suppress(BrokenPipeError):
            CaseServer(connection).serve()
    finally:
        # The caller may have been killed, and this one outlives it.
        shutil.rmtree(os.environ['ROS_LOG_DIR'], ignore_errors=True)
    sys.exit(0)
