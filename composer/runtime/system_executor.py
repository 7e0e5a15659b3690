"""The executor of a system: it spins in its own thread, and no error ends it."""

from __future__ import annotations

import threading
import warnings
from contextlib import suppress
from time import sleep
from typing import TYPE_CHECKING

from rclpy.executors import ExternalShutdownException, ShutdownException

from composer.errors import ComposerError
from composer.executor import ComposerExecutor
from composer.runtime.behaviours.error_reports import ErrorReporter
from composer.runtime.behaviours.tracebacks import format_internal_error
from composer.runtime.reserved_methods import release

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.context import Context

# After an unexpected error of the executor itself, which must not flood the log.
_PAUSE_SEC = 0.1


class NoResponseError(ComposerError):
    """Raised by a service's callback that has no response, to keep rclpy from sending one."""


class SystemExecutor(ComposerExecutor):
    """Runs the callbacks of all nodes, from `start` to `stop`.

    Args:
        threads: How many callbacks may run at the same time, not counting those that wait for
            others; `None` for no limit.
        log: Takes the text of an error outside all behaviours, after which the executor goes on.
        on_lost: Called when the context was shut down before `stop`.

    Attributes:
        errors: Logs the errors outside all behaviours.
    """

    def __init__(
        self,
        context: Context,
        threads: int | None,
        log: Callable[[str], None],
        on_lost: Callable[[], None] | None = None,
    ) -> None:
        with warnings.catch_warnings():
            # rclpy warns of a single thread, but means its own executors.
            warnings.simplefilter('ignore', UserWarning)
            super().__init__(threads, context=context)
        self.errors = ErrorReporter(log)
        self._on_lost = on_lost
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

    def _keep_spinning(self) -> None:
        self._spin_on()
        if self._on_lost is not None and not self._is_stopped:
            self._on_lost()

    def _spin_on(self) -> None:
        while not self._is_shutdown and self.context.ok():
            try:
                self.spin()
            except (ShutdownException, ExternalShutdownException):
                return
            except BaseException as error:  # noqa: BLE001 - one error must not end all nodes
                self.report(error)
                sleep(_PAUSE_SEC)
