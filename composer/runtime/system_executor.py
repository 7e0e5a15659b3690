"""The one place that knows how callbacks are dispatched."""

from __future__ import annotations

import threading
import traceback
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    ConditionReachedException,
    Executor,
    ExternalShutdownException,
    ShutdownException,
    TimeoutException,
)

from composer.errors import ComposerError
from composer.runtime.thread_pool import ThreadPool

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.task import Task

# Only bounds how long an end of spinning can go unnoticed if its wake-up is lost.
_LONGEST_WAIT_SEC = 0.5
_JOIN_TIMEOUT_SEC = 2.0


class NoResponseError(ComposerError):
    """Raised by a service's callback that cannot answer: rclpy sends a response otherwise."""


class _PooledExecutor(Executor):
    """An executor of rclpy that runs what is ready in a pool of threads.

    The stock one keeps a list of all it has ever offered to its pool until each has ended; a
    coroutine is in it once for every time that it was resumed.
    """

    def __init__(self, context: Context, pool: ThreadPool) -> None:
        super().__init__(context=context)
        self._pool = pool

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """See the base class."""
        self.submit_next(timeout_sec, _never)

    def submit_next(self, timeout_sec: float | None, is_over: Callable[[], bool]) -> None:
        """Give the pool what is ready next; return without it when `is_over` at a wake-up.

        Args:
            is_over: The same one each time: rclpy drops what else is ready when it is another.
        """
        with suppress(TimeoutException, ConditionReachedException):
            task, _entity, _node = self.wait_for_ready_callbacks(timeout_sec, None, is_over)
            self._pool.submit(task)


class SystemExecutor:
    """Runs the callbacks of all nodes, on threads of its own, until it is stopped.

    Args:
        threads: How many callbacks may run at the same time.
        report: Takes the text of a fault outside all behaviours; dispatching goes on.
    """

    def __init__(self, context: Context, threads: int, report: Callable[[str], None]) -> None:
        self._context = context
        self._report = report
        self._pool = ThreadPool(max(threads, 2), self._run)
        self._executor = _PooledExecutor(context, self._pool)
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
        return self._pool.waiting()

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
        ended = self._pool.shutdown(timeout_sec)
        self._executor.shutdown()
        return ended

    def _spin(self) -> None:
        while self._spinning and self._context.ok():
            try:
                self._executor.submit_next(_LONGEST_WAIT_SEC, self._is_over)
            except (ShutdownException, ExternalShutdownException):
                return
            except InvalidHandle:
                # A node was removed, and an entity of it destroyed just as the wait for it began.
                continue
            except Exception:  # noqa: BLE001 - one fault must not end the dispatch of all nodes
                self._report(traceback.format_exc())

    def _is_over(self) -> bool:
        return not self._spinning

    def _run(self, task: Task) -> None:
        try:
            task()
            if task.done():
                task.result()
        except NoResponseError:
            pass
        except BaseException:  # noqa: BLE001 - as above
            self._report(traceback.format_exc())


def _never() -> bool:
    return False
