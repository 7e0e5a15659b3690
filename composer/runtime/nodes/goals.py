"""Goals as behaviours see them: what `node.send_goal` returns."""

from __future__ import annotations

import queue
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalStatus

from composer.entity_kinds import GOAL_STATUSES
from composer.errors import GoalTimeoutError
from composer.runtime.tracing.tracer import COROUTINE, tracer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.errors import ComposerError
    from composer.runtime.behaviours.waits import Waits

STATUS_NAMES = dict(enumerate(GOAL_STATUSES))


class Goal:
    """A goal that a server has accepted.

    Attributes:
        feedback_queue: The feedback that has come, then `None` when the goal has ended.
        servers: What identifies the servers outside, one of which has it; empty for one in here.
    """

    def __init__(self, name: str, waits: Waits) -> None:
        self.feedback_queue: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.servers: frozenset[bytes] = frozenset()
        self._name = name
        self._waits = waits
        self._handle: Any = None
        self.result_future: Any = None

    def begin(self, handle: Any) -> None:
        """Take the handle of the accepted goal, and ask for its result."""
        self._handle = handle
        self.result_future = handle.get_result_async()

    def lose(self, error: ComposerError) -> None:
        """Let who waits for the result have an error, as the client goes."""
        if not self.result_future.done():
            self.result_future.set_exception(error)

    @property
    def status(self) -> str:
        """The state of the goal: `executing`, `succeeded`, `canceled`, `aborted`, and so on."""
        if self.result_future.exception() is not None:
            return STATUS_NAMES[GoalStatus.STATUS_UNKNOWN]
        if self.result_future.done():
            return STATUS_NAMES[self.result_future.result().status]
        return 'executing'

    @property
    def feedback(self) -> Iterator[Any]:
        """The feedback messages as they come, until the goal has ended; each comes once.

        It ends, too, when the server has left the ROS graph; `result` raises then.

        Raises:
            SystemStoppingError: A stop was requested while it waited for the next one.
        """
        while (message := self._waits.until_next(self.feedback_queue)) is not None:
            yield message
        self.feedback_queue.put(None)

    def cancel(self, timeout: float | None = 5.0) -> bool:
        """Ask the server to cancel the goal; return whether it agreed.

        Raises:
            GoalTimeoutError: It did not answer within `timeout` seconds.
        """
        future = self._handle.cancel_goal_async()
        if not self._waits.until_done(future, timeout):
            message = f"the server of '{self._name}' did not answer the request to cancel"
            raise GoalTimeoutError(message)
        return bool(future.result().goals_canceling)

    def result(self, timeout: float | None = None) -> Any:
        """Wait for the end of the goal, and return its result message; `status` says how it ended.

        Raises:
            GoalTimeoutError: It did not end within `timeout` seconds.
            ActionNotAvailableError: The server ended, or an edit took the action client away.
            SystemStoppingError: A stop was requested while it waited.
        """
        with tracer.noting('wait', self._waits.node, f"result of '{self._name}'"):
            is_done = self._waits.until_done(self.result_future, timeout)
        if not is_done:
            message = f"the goal of '{self._name}' did not end within {timeout:g} s"
            raise GoalTimeoutError(message)
        return self.result_future.result().result

    async def result_async(self) -> Any:
        """As `result`, without holding a thread while it waits."""
        with tracer.noting('wait', self._waits.node, f"result of '{self._name}'", COROUTINE):
            await self._waits.until_done_async(self.result_future, None)
        return self.result_future.result().result
