"""Action clients: `node.send_goal`, and behaviours that hear feedback and results."""

from __future__ import annotations

import threading
from collections import deque
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient as RosActionClient
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import QoSProfile

from composer.errors import (
    ActionNotAvailableError,
    GoalRejectedError,
    GoalTimeoutError,
)
from composer.interfaces.classes import import_interface
from composer.python_source.modules import FunctionKind
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.calls import Owner
from composer.runtime.messages.payloads import converter_for
from composer.runtime.nodes.goals import Goal

if TYPE_CHECKING:
    from rclpy.node import Node as RosNode
    from rclpy.task import Future

    from composer.language.specs import ActionClientSpec, BehaviourSpec
    from composer.runtime.nodes.behaviour_node import Payload
    from composer.runtime.nodes.live_node import LiveNode

# The middleware's default of 10 loses what comes faster than it is taken.
_QOS = QoSProfile(depth=1000)


def create_action_clients(node: LiveNode) -> None:
    """Create the clients; behaviours reach them through `node.send_goal`."""
    for spec in node.spec.action_clients.values():
        client = ActionClient(node, spec)
        node.entities['action_clients'][spec.name] = client
        node.at_destruction.append(client.destroy)


class ActionClient:
    """A client that converts payloads, and lets behaviours hear of all its goals."""

    def __init__(self, node: LiveNode, spec: ActionClientSpec) -> None:
        action_class: Any = import_interface(spec.type)
        self._node = node
        self._name = spec.action
        self._convert = converter_for(action_class.Goal).convert
        self._client = _Client(node.ros, action_class, spec.action)
        self._feedback = _Hearing(
            node, Owner('action client', spec.name, 'feedback'), spec.feedback
        )
        self._result = _Hearing(node, Owner('action client', spec.name, 'result'), spec.result)
        self.destroy = self._client.destroy

    def send_goal(self, payload: Payload, timeout_sec: float | None) -> Goal:
        """Send a goal and wait until it is accepted.

        Raises:
            PayloadError: The payload does not fit the goal.
            ActionNotAvailableError: No server appeared in time.
            GoalTimeoutError: The server did not answer in time.
            GoalRejectedError: It refused the goal.
            SystemStoppingError: A stop was requested while it waited.
        """
        message = self._convert(payload)
        begun = monotonic()
        waits = self._node.waits
        if not waits.until_true(self._client.server_is_ready, timeout_sec):
            text = f"no server of the action '{self._name}' appeared within {timeout_sec:g} s"
            raise ActionNotAvailableError(text)
        goal = Goal(self._name, self._node.waits, self._node.coroutine_waits)
        future = self._client.send_goal_async(message, partial(self._take_feedback, goal))
        left = None if timeout_sec is None else max(begun + timeout_sec - monotonic(), 0.0)
        if not waits.until_done(future, left):
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
                self._node.behaviour_node.logger.warning(
                    f"the goal of '{self._name}' was {goal.status}"
                )
            self._result.put(response.result)


class _Client(RosActionClient):
    """A client whose goals hear all their feedback in order, and before their result.

    The stock one may take an answer before it has noted the request, and then drops it.
    """

    def __init__(self, ros: RosNode, action_class: Any, name: str) -> None:
        self._noting = threading.RLock()
        super().__init__(
            ros,
            action_class,
            name,
            # Never beside itself, and never in a group of behaviours, which wait for it.
            callback_group=MutuallyExclusiveCallbackGroup(),
            goal_service_qos_profile=_QOS,
            result_service_qos_profile=_QOS,
            cancel_service_qos_profile=_QOS,
            feedback_sub_qos_profile=_QOS,
        )

    def add_future(self, future: Future) -> None:
        """Let whoever waits be woken at once, and not by the executor: see the base class."""

    def remove_future(self, future: Future) -> None:
        """See the base class."""

    def send_goal_async(self, *arguments: Any) -> Future:
        """See the base class."""
        with self._noting:
            return super().send_goal_async(*arguments)

    def _cancel_goal_async(self, goal_handle: Any) -> Future:
        with self._noting:
            return super()._cancel_goal_async(goal_handle)

    def _get_result_async(self, goal_handle: Any) -> Future:
        with self._noting:
            return super()._get_result_async(goal_handle)

    def take_data(self) -> dict[str, Any]:
        """See the base class."""
        with self._noting:
            data: dict[str, Any] = super().take_data()
        if 'result' in data:
            take = partial(
                self._client_handle.take_feedback, self._action_type.Impl.FeedbackMessage
            )
            data['last'] = [data.pop('feedback', None), *iter(take, None)]
        return data

    async def execute(self, taken_data: dict[str, Any]) -> None:
        """See the base class."""
        for message in taken_data.pop('last', ()):
            if message is not None:
                await super().execute({'feedback': message})
        await super().execute(taken_data)


class _Hearing:
    """Calls a behaviour for each item, as one of the node's own callbacks.

    What the middleware brings comes in a thread of its own; a guard condition takes it over into
    the node's callback group, so that the behaviour never runs beside the node's others.
    """

    def __init__(self, node: LiveNode, owner: Owner, behaviour: BehaviourSpec | None) -> None:
        self._items: deque[Any] = deque()
        self._guard: Any = None
        if behaviour is None:
            return
        function = node.function(behaviour)
        call = node.call(
            owner,
            behaviour.path,
            partial(function, node.behaviour_node, **behaviour.arguments),
            admits=node.gate.lets_events,
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
