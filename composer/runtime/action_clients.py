"""Action clients: `node.send_goal`, and behaviours that hear feedback and results."""

from __future__ import annotations

import queue
import time
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient as RosActionClient

from composer.errors import (
    ActionNotAvailableError,
    GoalRejectedError,
    GoalTimeoutError,
)
from composer.interfaces.classes import import_interface
from composer.python_source import FunctionKind
from composer.runtime.behaviours import kind_of
from composer.runtime.payloads import converter_for
from composer.runtime.waiting import poll_in_thread, wait_in_thread

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rclpy.task import Future

    from composer.language.specs import ActionClientSpec, BehaviourSpec
    from composer.runtime.live_node import LiveNode
    from composer.runtime.node import Payload

_STATUS_NAMES = {
    GoalStatus.STATUS_UNKNOWN: 'unknown',
    GoalStatus.STATUS_ACCEPTED: 'accepted',
    GoalStatus.STATUS_EXECUTING: 'executing',
    GoalStatus.STATUS_CANCELING: 'canceling',
    GoalStatus.STATUS_SUCCEEDED: 'succeeded',
    GoalStatus.STATUS_CANCELED: 'canceled',
    GoalStatus.STATUS_ABORTED: 'aborted',
}


def create_action_clients(node: LiveNode) -> None:
    """Create the clients; behaviours reach them through `node.send_goal`."""
    for spec in node.spec.action_clients.values():
        client = ActionClient(node, spec)
        node.action_clients[spec.name] = client
        node.at_destruction.append(client.destroy)


class ActionClient:
    """A client that converts payloads, and lets behaviours hear of all its goals."""

    def __init__(self, node: LiveNode, spec: ActionClientSpec) -> None:
        action_class: Any = import_interface(spec.type)
        owner = f"action client '{spec.name}'"
        self._node = node
        self._name = spec.action
        self._convert = converter_for(action_class.Goal).convert
        self._client = RosActionClient(
            node.ros, action_class, spec.action, callback_group=node.background
        )
        self._feedback = _Hearing(node, f'{owner} (feedback)', spec.feedback)
        self._result = _Hearing(node, f'{owner} (result)', spec.result)
        self.destroy = self._client.destroy

    def send_goal(self, payload: Payload, timeout_sec: float | None) -> Goal:
        """Send a goal and wait until it is accepted.

        Raises:
            PayloadError: The payload does not fit the goal.
            ActionNotAvailableError: No server appeared in time.
            GoalTimeoutError: The server did not answer in time.
            GoalRejectedError: It refused the goal.
        """
        message = self._convert(payload)
        begun = time.monotonic()
        waiting = self._node.services.waiting
        if not poll_in_thread(self._client.server_is_ready, timeout_sec, waiting):
            text = f"no server of the action '{self._name}' appeared within {timeout_sec:g} s"
            raise ActionNotAvailableError(text)
        goal = Goal(self._name, self._node)
        future = self._client.send_goal_async(message, partial(self._take_feedback, goal))
        left = None if timeout_sec is None else max(begun + timeout_sec - time.monotonic(), 0.0)
        if not wait_in_thread(future, left, waiting):
            text = f"the server of '{self._name}' did not answer within {timeout_sec:g} s"
            raise GoalTimeoutError(text)
        handle = future.result()
        if not handle.accepted:
            text = f"the server of '{self._name}' refused the goal"
            raise GoalRejectedError(text)
        goal.begin(handle)
        goal.result_future.add_done_callback(partial(self._take_result, goal))
        return goal

    def _take_feedback(self, goal: Goal, message: Any) -> None:
        goal.heard.put(message.feedback)
        self._feedback.put(message.feedback)

    def _take_result(self, goal: Goal, future: Future) -> None:
        goal.heard.put(None)
        if future.done() and (response := future.result()) is not None:
            if response.status != GoalStatus.STATUS_SUCCEEDED:
                self._node.face.logger.warning(f"the goal of '{self._name}' was {goal.status}")
            self._result.put(response.result)


class Goal:
    """A goal that a server has accepted.

    Attributes:
        heard: The feedback that has come, then `None` when the goal has ended.
    """

    def __init__(self, name: str, node: LiveNode) -> None:
        self.heard: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._name = name
        self._node = node
        self._handle: Any = None
        self.result_future: Any = None

    def begin(self, handle: Any) -> None:
        """Take the handle of the accepted goal, and ask for its result."""
        self._handle = handle
        self.result_future = handle.get_result_async()

    @property
    def status(self) -> str:
        """How the goal is: `executing`, `succeeded`, `canceled`, `aborted`, and so on."""
        if self.result_future.done():
            return _STATUS_NAMES[self.result_future.result().status]
        return 'executing'

    @property
    def feedback(self) -> Iterator[Any]:
        """The feedback messages as they come, until the goal has ended; each comes once."""
        with self._node.services.waiting():
            while (message := self.heard.get()) is not None:
                yield message
        self.heard.put(None)

    def cancel(self, timeout: float | None = 5.0) -> bool:
        """Ask the server to cancel the goal; return whether it agreed.

        Raises:
            GoalTimeoutError: It did not answer within `timeout` seconds.
        """
        future = self._handle.cancel_goal_async()
        if not wait_in_thread(future, timeout, self._node.services.waiting):
            message = f"the server of '{self._name}' did not answer the request to cancel"
            raise GoalTimeoutError(message)
        return bool(future.result().goals_canceling)

    def result(self, timeout: float | None = None) -> Any:
        """Wait for the end of the goal, and return its result message; `status` says how it ended.

        Raises:
            GoalTimeoutError: It did not end within `timeout` seconds.
        """
        if not wait_in_thread(self.result_future, timeout, self._node.services.waiting):
            message = f"the goal of '{self._name}' did not end within {timeout:g} s"
            raise GoalTimeoutError(message)
        return self.result_future.result().result

    async def result_async(self) -> Any:
        """As `result`, without holding a thread while it waits."""
        return (await self.result_future).result


class _Hearing:
    """Calls a behaviour for each item, as one of the node's own callbacks.

    What the middleware brings comes in a thread of its own; a guard condition takes it over into
    the node's callback group, so that the behaviour never runs beside the node's others.
    """

    def __init__(self, node: LiveNode, owner: str, behaviour: BehaviourSpec | None) -> None:
        self._items: deque[Any] = deque()
        self._guard: Any = None
        if behaviour is None:
            return
        function = node.function(behaviour)
        call = node.call(
            owner, behaviour.path, partial(function, node.face, **behaviour.arguments)
        )
        kind = kind_of(function)
        self._callback = call.as_callback(kind)
        drain = self._drain_async if kind is FunctionKind.COROUTINE else self._drain
        self._guard = node.ros.create_guard_condition(drain, callback_group=node.group(None))

    def put(self, item: Any) -> None:
        """Let the behaviour be called with an item."""
        if self._guard is not None:
            self._items.append(item)
            self._guard.trigger()

    def _drain(self) -> None:
        while self._items:
            self._callback(self._items.popleft())

    async def _drain_async(self) -> None:
        while self._items:
            await self._callback(self._items.popleft())
