"""Goals of clients of the same system are handed over, with their feedback and results."""

from __future__ import annotations

import weakref
from functools import partial
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.action.client import ClientGoalHandle
from rclpy.action.server import GoalEvent, RCLError, ServerGoalHandle
from rclpy.executors import await_or_execute
from rclpy.task import Future

from composer.runtime.messages.ownership import ownership_of
from composer.runtime.middleware.lost_participants import list_servers

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.runtime.messages.local_services import LocalClient, LocalServer
    from composer.runtime.middleware.lost_participants import LostParticipants


class GoalServer(ActionServer):
    """An action server that takes goals from clients of the same system, too.

    It does for these what rclpy's does, which can only answer by the middleware. Their status is
    published as that of all others.

    Attributes:
        local: Where requests are handed to it.
    """

    local: LocalServer

    async def serve_goal(
        self,
        goal_id: Any,
        goal: Any,
        answer: Callable[[Any], None],
        hear: Callable[[Any], None],
    ) -> None:
        """Decide on a goal, and begin it if it is accepted.

        Args:
            answer: Takes the response.
            hear: Takes the messages of feedback.
        """
        info = GoalInfo(goal_id=goal_id)
        decision = await await_or_execute(self._goal_callback, goal)
        handle = None
        if decision == GoalResponse.ACCEPT:
            info.stamp = self._node.get_clock().now().to_msg()
            with self._lock:
                handle = _ServedGoal(self, info, goal, hear)
            key = bytes(goal_id.uuid)
            self._goal_handles[key] = handle
            self._result_futures[key] = Future()
        service = self._action_type.Impl.SendGoalService
        answer(service.Response(accepted=handle is not None, stamp=info.stamp))
        if handle is not None:
            self._handle.publish_status()
            await await_or_execute(self._handle_accepted_callback, handle)

    async def serve_cancel(self, request: Any, answer: Callable[[Any], None]) -> None:
        """Cancel the goals that a request names, as far as possible."""
        service = self._action_type.Impl.CancelGoalService
        with self._lock:
            response = self._handle.process_cancel_request(request, service.Response)
        cancelled = []
        for info in response.goals_canceling:
            goal = self._goal_handles.get(bytes(info.goal_id.uuid))
            if goal is not None and await self._cancels(goal):
                cancelled.append(info)
        response.goals_canceling = cancelled
        answer(response)

    async def _cancels(self, goal: Any) -> bool:
        if await await_or_execute(self._cancel_callback, goal) != CancelResponse.ACCEPT:
            return False
        try:
            goal._update_state(GoalEvent.CANCEL_GOAL)  # noqa: SLF001
        except RCLError:
            return False  # It has just ended.
        return True

    async def serve_result(self, goal_id: Any, answer: Callable[[Any], None]) -> None:
        """Give the result of a goal, when it has ended."""
        future = self._result_futures.get(bytes(goal_id.uuid))
        service = self._action_type.Impl.GetResultService
        if future is None:
            answer(service.Response(status=GoalStatus.STATUS_UNKNOWN))
            return

        def answer_now(done: Future) -> None:
            response = done.result()
            # Others may ask for it, too.
            result = ownership_of(self._action_type.Result).copy(response.result)
            answer(service.Response(status=response.status, result=result))

        future.add_done_callback(answer_now)


class _ServedGoal(ServerGoalHandle):
    """A goal whose client is in the same system."""

    def __init__(
        self, server: GoalServer, info: Any, goal: Any, hear: Callable[[Any], None]
    ) -> None:
        super().__init__(server, info, goal)
        self._hear = hear
        self._message_class = server.action_type.Impl.FeedbackMessage
        self._copy = ownership_of(server.action_type.Feedback).copy
        self._server = server

    def publish_feedback(self, feedback: Any) -> None:
        """See the base class."""
        if self._goal_handle is None:
            return
        self._hear(self._message_class(goal_id=self.goal_id, feedback=self._copy(feedback)))
        if self._has_listeners_outside():
            super().publish_feedback(feedback)

    def _has_listeners_outside(self) -> bool:
        local, node = self._server.local, self._server._node  # noqa: SLF001
        return bool(node.count_subscribers(f'{local.key[0]}/_action/feedback') > local.clients)


class GoalClient(ActionClient):
    """An action client that hands goals to a server of the same system.

    Attributes:
        local: Knows that server.
    """

    local: LocalClient

    def server_is_ready(self) -> bool:
        """See the base class."""
        if self.local.server is not None:
            return True
        lost: LostParticipants = self._node.lost
        # The second of its services: the first one is there by then, too.
        results = f'{self.local.key[0]}/_action/get_result'
        return super().server_is_ready() and not lost.have_all_servers(self._node, results)

    def servers_outside(self) -> frozenset[bytes]:
        """Return what identifies the servers in other processes; none if goals are handed over."""
        if self.local.server is not None:
            return frozenset()
        return list_servers(self._node, f'{self.local.key[0]}/_action/get_result')

    def send_goal_async(
        self, goal: Any, feedback_callback: Any = None, goal_uuid: Any = None
    ) -> Future:
        """See the base class."""
        server = self.local.server
        if server is None:
            return super().send_goal_async(goal, feedback_callback, goal_uuid)
        goal_id = self._generate_random_uuid()
        future = Future()

        def answer(response: Any) -> None:
            handle = _SentGoal(self, goal_id, response)
            if handle.accepted:
                # Its status comes by the middleware.
                self._goal_handles[bytes(goal_id.uuid)] = weakref.ref(handle)
            _settle(future, handle)

        goal = ownership_of(self._action_type.Goal).copy(goal)
        server.inbox.put(partial(server.ros.serve_goal, goal_id, goal, answer, feedback_callback))
        return future

    def _cancel_goal_async(self, goal_handle: Any) -> Future:
        server = self._find_server(goal_handle)
        if server is None:
            return super()._cancel_goal_async(goal_handle)
        request = CancelGoal.Request()
        request.goal_info.goal_id = goal_handle.goal_id
        future = Future()
        server.inbox.put(partial(server.ros.serve_cancel, request, partial(_settle, future)))
        return future

    def _get_result_async(self, goal_handle: Any) -> Future:
        server = self._find_server(goal_handle)
        if server is None:
            return super()._get_result_async(goal_handle)
        future = Future()
        answer = partial(_settle, future)
        server.inbox.put(partial(server.ros.serve_result, goal_handle.goal_id, answer))
        return future

    def _find_server(self, goal_handle: Any) -> LocalServer | None:
        """Return who has a goal that was handed over."""
        return self.local.server if isinstance(goal_handle, _SentGoal) else None


class _SentGoal(ClientGoalHandle):
    """A goal that was handed over."""


def _settle(future: Future, result: Any) -> None:
    if not future.done():
        future.set_result(result)
