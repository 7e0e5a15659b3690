"""The executor of a whole system: it spins by itself, and no fault of one part ends it."""

from __future__ import annotations

import threading
import warnings
from contextlib import suppress
from time import sleep
from typing import TYPE_CHECKING

from rclpy.executors import ExternalShutdownException, ShutdownException

from composer.errors import ComposerError
from composer.executor import ComposerExecutor
from composer.runtime.behaviours.tracebacks import format_fault
from composer.runtime.ownership import release

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.context import Context

# After a fault of the executor itself, which should not be; it must not fill the log.
_PAUSE_SEC = 0.1


class NoResponseError(ComposerError):
    """Raised by a service's callback that cannot answer: rclpy sends a response otherwise."""


class SystemExecutor(ComposerExecutor):
    """Runs the callbacks of all nodes, from `start` to `stop`.

    Args:
        threads: How many callbacks may run at the same time, without those that wait for others;
            `None` for as many as block.
        log: Takes the text of a fault outside all behaviours; dispatching goes on.
        lost: Called when no callback can run any more, though nobody has called `stop`.
    """

    def __init__(
        self,
        context: Context,
        threads: int | None,
        log: Callable[[str], None],
        lost: Callable[[], None] | None = None,
    ) -> None:
        with warnings.catch_warnings():
            # rclpy advises against one thread here, but means its own executors.
            warnings.simplefilter('ignore', UserWarning)
            super().__init__(threads, context=context)
        self._log = log
        self._lost = lost
        self._is_stopped = False
        self._thread = threading.Thread(
            target=self._keep_spinning, name='composer-executor', daemon=True
        )

    def start(self) -> None:
        """Begin to run callbacks."""
        self._thread.start()

    def stop(self, timeout_sec: float) -> bool:
        """Run no more callbacks.

        Returns:
            Whether all that were running have ended in time.
        """
        self._is_stopped = True
        release(self)
        return self.shutdown(timeout_sec)

    def report(self, error: BaseException) -> None:
        """Log what a callback raised; where others spin, rclpy's executors end by it."""
        if not isinstance(error, NoResponseError):
            # What comes out of here would end the thread that spins.
            with suppress(Exception):
                self._log(format_fault(error))

    def _keep_spinning(self) -> None:
        self._spin_on()
        if self._lost is not None and not self._is_stopped:
            self._lost()

    def _spin_on(self) -> None:
        while not self._is_shutdown and self.context.ok():
            try:
                self.spin()
            except (ShutdownException, ExternalShutdownException):
                return
            except BaseException as error:  # noqa: BLE001 - one fault must not end all nodes
                self.report(error)
                sleep(_PAUSE_SEC)
