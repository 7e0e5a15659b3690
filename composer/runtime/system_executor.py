"""The executor of a system: it spins in its own thread, and no error ends it."""

from __future__ import annotations

import builtins
import errno
import threading
from collections import deque
from contextlib import suppress
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.executors import ExternalShutdownException, ShutdownException

from composer.errors import EndedWhileWaitingError
from composer.executor import ComposerExecutor
from composer.executor.descriptors import ExecutorError
from composer.runtime.behaviours.error_reports import ErrorReporter
from composer.runtime.behaviours.requests import NoResponseError, RequestFailure, failed_call
from composer.runtime.behaviours.tracebacks import format_internal_error
from composer.runtime.reserved_methods import release

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.context import Context

# After an unexpected error of the executor itself, and how many of them in a row end the system.
_PAUSE_SEC = 0.1
_MOST_FAILURES = 3
_RECOVERED_SEC = 10.0
_MOST_NAMES = 5


class SystemExecutor(ComposerExecutor):
    """Runs the callbacks of all nodes, from `start` to `stop`.

    Args:
        threads: How many callbacks may run at the same time, not counting those that wait for
            others; `None` for no limit.
        log: Takes the text of an error outside all behaviours, after which the executor goes on.
        on_lost: Called when the context was shut down before `stop`.
        on_broken: Called when the executor cannot go on, with the reason.
        on_unanswered: Called with each request over the middleware that gets no response.

    Attributes:
        errors: Logs the errors outside all behaviours.
        runs_in_real_time: Whether its clocks are those of the middleware.
    """

    runs_in_real_time = True

    def __init__(
        self,
        context: Context,
        threads: int | None,
        log: Callable[[str], object],
        on_lost: Callable[[], None] | None = None,
        on_broken: Callable[[str], None] | None = None,
        on_unanswered: Callable[[RequestFailure], None] | None = None,
    ) -> None:
        super().__init__(threads, context=context)
        self.errors = ErrorReporter(log)
        self._on_lost = on_lost
        self._on_broken = on_broken
        self._on_unanswered = on_unanswered
        self._failures = deque([float('-inf')] * _MOST_FAILURES, maxlen=_MOST_FAILURES)
        self._builtins = dict(builtins.__dict__)
        self._is_stopped = False
        self._thread = threading.Thread(
            target=self._keep_spinning, name='composer-executor', daemon=True
        )

    def start(self) -> None:
        """Start to run callbacks."""
        self._thread.start()

    def stop(self, timeout_sec: float) -> bool:
        """Stop to run callbacks.

        Returns:
            Whether all running ones have ended in time.
        """
        self._is_stopped = True
        release(self)
        return self.shutdown(timeout_sec)

    def report(self, error: BaseException) -> None:
        """Log an error of a callback; rclpy's own executors end by it."""
        if not isinstance(error, NoResponseError):
            # An error raised here would end the thread that spins.
            with suppress(Exception):
                self.errors.report('a callback', error, format_internal_error)

    def note_unanswered(self, service: Any, header: Any, error: BaseException) -> None:
        """See the base class."""
        # An error raised here would hide the other one.
        with suppress(Exception):
            if self._on_unanswered is not None:
                name, sequence = service.service_name, header.request_id.sequence_number
                sent_ns = header.source_timestamp if self.runs_in_real_time else None
                failure = RequestFailure(name, sequence, sent_ns, failed_call(name, error))
                self._on_unanswered(failure)

    def _keep_spinning(self) -> None:
        try:
            self._spin_on()
        finally:
            if self._on_lost is not None and not self._is_stopped:
                self._on_lost()

    def _spin_on(self) -> None:
        while not self._is_shutdown and self.context.ok():
            try:
                self.spin()
            except (ShutdownException, ExternalShutdownException):
                return
            except EndedWhileWaitingError:
                self._is_stopped = True
                return
            except BaseException as error:  # noqa: BLE001 - one error must not end all nodes
                replaced = self._restore_builtins()
                if replaced or self._is_broken_by(error):
                    self._break(error, replaced)
                    return
                self.report(error)
                sleep(_PAUSE_SEC)

    def _is_broken_by(self, error: BaseException) -> bool:
        """Return whether the executor cannot spin any more."""
        self._failures.append(monotonic())
        is_frequent = self._failures[-1] - self._failures[0] < _RECOVERED_SEC
        is_closed = isinstance(error, OSError) and error.errno == errno.EBADF
        return is_closed or isinstance(error, ExecutorError) or is_frequent

    def _restore_builtins(self) -> list[str]:
        """Give Python back the builtins that it had, for the stop; return which were replaced."""
        now = builtins.__dict__
        replaced = [name for name, value in self._builtins.items() if now.get(name) is not value]
        now.update(self._builtins)
        return replaced

    def _break(self, error: BaseException, replaced: list[str]) -> None:
        if replaced:
            reason = f'builtins were replaced: {", ".join(replaced[:_MOST_NAMES])}'
        elif isinstance(error, ExecutorError):
            reason = str(error)
        else:
            reason = format_internal_error(error)
        if self._on_broken is not None and not self._is_stopped:
            self._on_broken(reason)
