"""Action clients: `node.send_goal`, and behaviours for feedback and results."""

from __future__ import annotations

import threading
from functools import partial
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

from action_msgs.msg import GoalStatus
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import QoSProfile

from composer.errors import (
    ActionNotAvailableError,
    GoalRejectedError,
    GoalTimeoutError,
)
from composer.interfaces.classes import import_interface
from composer.runtime.behaviours.requests import Requests
from composer.runtime.behaviours.waits import WaitNotice
from composer.runtime.entities.event_behaviours import EventBehaviours
from composer.runtime.entities.local_goals import GoalClient
from composer.runtime.messages.ownership import ownership_of
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


class ActionClient:
    """A client that converts payloads, and calls behaviours for what comes of all its goals."""

    def __init__(self, node: LiveNode, spec: ActionClientSpec) -> None:
        action_class: Any = import_interface(spec.type)
        self._node = node
        self._name = node.ros.resolve_action_name(spec.action)
        self._logger = node.ros.get_logger()
        self._convert = converter_for(action_class.Goal).convert
        self._client = _Client(node.ros, action_class, spec.action)
        services = node.system.services
        self._local = services.add_client(node.ros, self._client, (self._name, action_class))
        self._client.local = self._local
        self._local.allow(is_allowed=spec.local_delivery)
        self._requests = Requests(
            node.waits,
            self._client.server_is_ready,
            WaitNotice(self._logger.info, f"action server '{self._name}'"),
            self._unavailable,
            self._unanswered,
            self._lost,
        )
        self._behaviours = EventBehaviours(node, 'action client', spec.name)
        self._behaviours.change(_behaviours_of(spec))
        self._goals: WeakSet[Goal] = WeakSet()
        node.at_destruction.append(self._client.destroy)

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
        goal = Goal(self._name, self._node.waits)
        losses = self._requests.losses

        def send() -> Future:
            nonlocal losses
            losses = self._requests.losses
            return self._client.send_goal_async(message, partial(self._take_feedback, goal))

        handle = self._requests.send(send, timeout_sec)
        if not handle.accepted:
            text = f"the server of '{self._name}' refused the goal"
            raise GoalRejectedError(text)
        goal.begin(handle)
        goal.servers = self._client.servers_outside()
        self._goals.add(goal)
        goal.result_future.add_done_callback(partial(self._take_result, goal))
        # Its server may have gone before it was one of the goals.
        if self._requests.losses != losses:
            self.lose_server()
        return goal

    def delivery(self) -> tuple[str, str, int]:
        """Return which way goals go now, why, and how many; see `LocalClient.delivery`."""
        return *self._local.delivery(), self._requests.sent

    def change(self, spec: ActionClientSpec) -> None:
        """See `LiveEntity`."""
        self._behaviours.change(_behaviours_of(spec))
        self._local.allow(is_allowed=spec.local_delivery)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self._node.at_destruction.remove(self._client.destroy)
        error = ActionNotAvailableError(f"an edit took the action client of '{self._name}' away")
        self._requests.end(error)
        self._lose_goals(error)
        self._node.system.services.remove(self._local)
        self._client.destroy()
        self._behaviours.destroy()

    def lose_server(self) -> None:
        """End the goals that were sent or accepted, if the server was killed."""
        if self._requests.lose():
            self._lose_goals(self._lost())

    def check_servers(self) -> None:
        """End the goals whose servers have left the graph: a new server does not know them."""
        goals = [goal for goal in list(self._goals) if goal.servers]
        if all(goal.result_future.done() for goal in goals):
            return
        servers = self._client.servers_outside()
        for goal in goals:
            if goal.servers.isdisjoint(servers):
                goal.lose(self._lost())

    def _lost(self) -> ActionNotAvailableError:
        message = f"the action server '{self._name}' ended before the goal did"
        return ActionNotAvailableError(message)

    def _lose_goals(self, error: ActionNotAvailableError) -> None:
        for goal in list(self._goals):
            goal.lose(error)

    def _unavailable(self, timeout_sec: float) -> ActionNotAvailableError:
        message = f"no server of the action '{self._name}' appeared within {timeout_sec:g} s"
        return ActionNotAvailableError(message)

    def _unanswered(self, timeout_sec: float) -> GoalTimeoutError:
        message = f"the server of '{self._name}' did not answer within {timeout_sec:g} s"
        return GoalTimeoutError(message)

    def _take_feedback(self, goal: Goal, message: Any) -> None:
        goal.feedback_queue.put(message.feedback)
        self._tell('feedback', message.feedback)

    def _tell(self, key: str, item: Any) -> None:
        if self._behaviours.has(key):
            # Who holds the goal gets it, too.
            message_class: type = type(item)
            self._behaviours.put(key, ownership_of(message_class).copy(item))

    def _take_result(self, goal: Goal, future: Future) -> None:
        goal.feedback_queue.put(None)
        if future.exception() is None and (response := future.result()) is not None:
            if response.status != GoalStatus.STATUS_SUCCEEDED:
                self._logger.warning(f"the goal of '{self._name}' was {goal.status}")
            self._tell('result', response.result)


def _behaviours_of(spec: ActionClientSpec) -> dict[str, BehaviourSpec]:
    behaviours = {'feedback': spec.feedback, 'result': spec.result}
    return {key: each for key, each in behaviours.items() if each is not None}


class _Client(GoalClient):
    """A client whose goals get all their feedback in order, and before their result.

    The stock one may take an answer before it has registered the request, and then drops it.
    """

    def __init__(self, ros: RosNode, action_class: Any, name: str) -> None:
        self._registering = threading.RLock()
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
        """Let those who wait be woken at once, and not by the executor: see the base class."""

    def remove_future(self, future: Future) -> None:
        """See the base class."""

    def send_goal_async(self, *arguments: Any) -> Future:
        """See the base class."""
        with self._registering:
            return super().send_goal_async(*arguments)

    def _cancel_goal_async(self, goal_handle: Any) -> Future:
        with self._registering:
            return super()._cancel_goal_async(goal_handle)

    def _get_result_async(self, goal_handle: Any) -> Future:
        with self._registering:
            return super()._get_result_async(goal_handle)

    def take_data(self) -> dict[str, Any]:
        """See the base class."""
        with self._registering:
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
