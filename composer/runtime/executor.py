"""The one place that knows how callbacks are dispatched."""

from __future__ import annotations

import threading
import traceback
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, ShutdownException

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.task import Task

# Only bounds how long an end of spinning can go unnoticed if its wake-up is lost.
_LONGEST_WAIT_SEC = 0.5
_JOIN_TIMEOUT_SEC = 2.0


class NoResponseError(ComposerError):
    """Raised by a service's callback that cannot answer: rclpy sends a response otherwise."""


class _ElasticExecutor(MultiThreadedExecutor):
    """The stock executor with a pool that grows while callbacks wait for other callbacks.

    Its idle threads end with it, and not with a later collection.
    """

    def __init__(self, num_threads: int, context: Context) -> None:
        super().__init__(num_threads=num_threads, context=context)
        self._growth = threading.Lock()

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Let another thread work while this one waits for something that callbacks bring."""
        pool = self._executor
        with self._growth:
            # Nothing public lets a pool of the standard library grow.
            pool._max_workers += 1  # noqa: SLF001
            pool._adjust_thread_count()  # noqa: SLF001
        try:
            yield
        finally:
            with self._growth:
                pool._max_workers -= 1  # noqa: SLF001

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """See the base class."""
        ended = bool(super().shutdown(timeout_sec))
        self._executor.shutdown(wait=ended, cancel_futures=True)
        return ended


class SystemExecutor:
    """Runs the callbacks of all nodes, on threads of its own, until it is stopped.

    Args:
        threads: How many callbacks may run at the same time.
        report: Takes the text of a fault outside all behaviours; dispatching goes on.
    """

    def __init__(self, context: Context, threads: int, report: Callable[[str], None]) -> None:
        self._context = context
        self._report = report
        self._executor = _ElasticExecutor(max(threads, 2), context)
        self._spinning = False
        self._thread = threading.Thread(target=self._spin, name='composer-executor', daemon=True)

    def add_node(self, node: Node) -> None:
        """Let the node's callbacks run."""
        self._executor.add_node(node)

    def remove_node(self, node: Node) -> None:
        """Let none of the node's callbacks begin any more."""
        self._executor.remove_node(node)

    def create_task(self, callback: Callable[..., Any], *arguments: Any) -> Task:
        """Run a function or coroutine function among the callbacks."""
        task = self._executor.create_task(callback, *arguments)
        self.wake()
        return task

    def waiting(self) -> AbstractContextManager[None]:
        """Return the context in which a callback may wait for other callbacks."""
        return self._executor.waiting()

    def wake(self) -> None:
        """Look again which callbacks may run: a gate has opened, say."""
        self._executor.wake()

    def start(self) -> None:
        """Begin to run callbacks."""
        self._spinning = True
        self._thread.start()

    def stop(self, timeout_sec: float) -> bool:
        """Run no more callbacks.

        Returns:
            Whether all that were running have ended in time.
        """
        self._spinning = False
        if self._thread.is_alive():
            self._executor.wake()
            self._thread.join(_JOIN_TIMEOUT_SEC)
        return bool(self._executor.shutdown(timeout_sec=timeout_sec))

    def _spin(self) -> None:
        while self._spinning and self._context.ok():
            try:
                self._executor.spin_once(timeout_sec=_LONGEST_WAIT_SEC)
            except NoResponseError:
                continue
            except (ShutdownException, ExternalShutdownException):
                return
            except Exception:  # noqa: BLE001 - one fault must not end the dispatch of all nodes
                self._report(traceback.format_exc())
