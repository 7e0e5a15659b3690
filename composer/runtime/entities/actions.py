"""Actions: goals accepted, executed beside each other as declared, cancelled at a `yield`."""

from __future__ import annotations

import threading
from contextlib import aclosing, closing
from dataclasses import replace
from functools import partial
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import RCLError
from rclpy.qos import QoSProfile

from composer.interfaces.classes import import_interface
from composer.python_source.modules import FunctionKind
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.calls import Owner, Pace
from composer.runtime.entities.goal_queue import GoalQueue, goal_key
from composer.runtime.messages.payloads import converter_for

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import ActionSpec, BehaviourSpec
    from composer.runtime.nodes.live_node import LiveNode

_POLL_SEC = 0.005
# A cancel request takes effect right after its callback; this only bounds a fault of the server.
_CANCEL_SEC = 5.0
# The middleware's default of 10 loses requests when more goals come at once.
_SERVICE_QOS = QoSProfile(depth=1000)


def create_actions(node: LiveNode) -> None:
    """Create the actions that the node serves."""
    for spec in node.spec.actions.values():
        server = _Server(node, spec)
        node.at_destruction.append(server.destroy)


class _Server(ActionServer):
    """An action server whose plain and generator behaviours run in threads of their own.

    The stock server executes goals in the executor's pool, where goals that sleep keep requests
    to cancel them from being heard.
    """

    def __init__(self, node: LiveNode, spec: ActionSpec) -> None:
        self._queue = GoalQueue(spec.concurrency, _start)
        self._execution = _Execution(node, spec, self._queue)
        self._live = node
        self._owner = Owner('action', spec.name)
        self._spec = spec
        self._tokens: dict[bytes, int] = {}
        super().__init__(
            node.ros,
            import_interface(spec.type),
            spec.action,
            execute_callback=self._execution.callback,
            callback_group=node.serving,
            goal_callback=self._decide,
            handle_accepted_callback=self._add,
            cancel_callback=self._cancel,
            goal_service_qos_profile=_SERVICE_QOS,
            result_service_qos_profile=_SERVICE_QOS,
            cancel_service_qos_profile=_SERVICE_QOS,
        )

    def add_future(self, future: Any) -> None:
        """Let results be sent by whom they come from: see the base class.

        The executor, which sends them otherwise, may have been stopped by then.
        """

    def remove_future(self, future: Any) -> None:
        """See the base class."""

    def notify_execute(self, goal_handle: Any, execute_callback: Any) -> None:
        """See the base class."""
        callback = execute_callback or self._execution.callback
        if self._execution.is_async:
            self._live.services.executor.create_task(self._execute_in_task, callback, goal_handle)
        else:
            threading.Thread(
                target=self._execute_in_thread, args=(callback, goal_handle), daemon=True
            ).start()

    async def _execute_in_task(self, callback: Any, goal: Any) -> None:
        try:
            await self._execute_goal(callback, goal)
        finally:
            self._end(goal)

    def _execute_in_thread(self, callback: Any, goal: Any) -> None:
        try:
            # Nothing in it waits: the callback is a plain function.
            self._execute_goal(callback, goal).send(None)
        except StopIteration:
            pass
        finally:
            self._end(goal)

    def _add(self, goal: Any) -> None:
        # The node has not ended before the results of all its goals are sent.
        self._tokens[goal_key(goal)] = self._live.ledger.begin()
        self._queue.add(goal)

    def _end(self, goal: Any) -> None:
        self._live.ledger.end(self._tokens.pop(goal_key(goal)))

    async def _decide(self, goal: Any) -> GoalResponse:
        if self._execution.is_ending() or not self._queue.has_room():
            return GoalResponse.REJECT
        accept = self._spec.accept
        if accept is None:
            return GoalResponse.ACCEPT
        answers: list[Any] = []
        await self._ask(accept, goal, answers)
        if not answers:
            # It raised.
            return GoalResponse.REJECT
        answer = answers[0]
        if answer is False or isinstance(answer, str):
            reason = f': {answer}' if answer else ''
            self._live.behaviour_node.logger.info(f'{self._owner} refused a goal{reason}')
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    async def _ask(self, accept: BehaviourSpec, goal: Any, answers: list[Any]) -> None:
        function = self._live.function(accept)
        call = self._live.call(
            replace(self._owner, key='accept'),
            accept.path,
            partial(function, self._live.behaviour_node, **accept.arguments),
            rules=self._spec,
            admits=self._live.gate.lets_requests,
        ).delivering(answers.append)
        if kind_of(function) is FunctionKind.COROUTINE:
            await call.as_callback(FunctionKind.COROUTINE)(goal)
        else:
            call.run(goal)

    def _cancel(self, goal: Any) -> CancelResponse:
        if self._queue.take_out(goal):
            threading.Thread(target=self._end_cancelled, args=(goal,), daemon=True).start()
        return CancelResponse.ACCEPT

    def _end_cancelled(self, goal: Any) -> None:
        """Give a goal that was cancelled while it waited its final state."""
        deadline = monotonic() + _CANCEL_SEC
        while not goal.is_cancel_requested and monotonic() < deadline:
            sleep(_POLL_SEC)
        _start(goal)


def _start(goal: Any) -> None:
    try:
        goal.execute()
    except RCLError:
        # A request to cancel it came in just now; the second time, that is seen.
        goal.execute()


class _Execution:
    """Runs the behaviour of an action for one goal after another."""

    def __init__(self, node: LiveNode, spec: ActionSpec, queue: GoalQueue) -> None:
        action_class: Any = import_interface(spec.type)
        behaviour = node.function(spec.behaviour)
        self._node = node
        self._queue = queue
        self._begin = node.bind(spec.behaviour)
        self._kind = kind_of(behaviour)
        self._result_class = action_class.Result
        self._feedback_class = action_class.Feedback
        self._to_result = converter_for(action_class.Result).convert
        self._to_feedback = converter_for(action_class.Feedback).convert
        self.is_async = self._kind in (FunctionKind.COROUTINE, FunctionKind.ASYNC_GENERATOR)
        drives = {
            FunctionKind.GENERATOR: self._drive,
            FunctionKind.ASYNC_GENERATOR: self._drive_async,
            FunctionKind.COROUTINE: self._call_async,
        }
        self._goal_call = node.call(
            Owner('action', spec.name),
            spec.path,
            drives.get(self._kind, self._call),
            rules=spec,
        )
        self.callback: Callable[[Any], Any] = (
            self._execute_async if self.is_async else self._execute
        )

    def _execute(self, goal: Any) -> Any:
        results: list[Any] = []
        try:
            if not self._end_early(goal):
                pace = Pace()
                self._goal_call.delivering(results.append, pace).run(goal, pace)
            return self._result_of(goal, results)
        finally:
            self._queue.finished(goal)

    async def _execute_async(self, goal: Any) -> Any:
        results: list[Any] = []
        try:
            if not self._end_early(goal):
                pace = Pace()
                call = self._goal_call.delivering(results.append, pace)
                await call.as_callback(FunctionKind.COROUTINE)(goal, pace)
            return self._result_of(goal, results)
        finally:
            self._queue.finished(goal)

    def _result_of(self, goal: Any, results: list[Any]) -> Any:
        if goal.is_active:
            # Its behaviour raised.
            goal.abort()
        return results[0] if results else self._result_class()

    def _call(self, goal: Any, _pace: Pace) -> Any:
        return self._succeed(goal, self._begin(goal.request))

    async def _call_async(self, goal: Any, _pace: Pace) -> Any:
        return self._succeed(goal, await self._begin(goal.request))

    def _drive(self, goal: Any, pace: Pace) -> Any:
        with closing(self._begin(goal.request)) as generator:
            while True:
                try:
                    feedback = next(generator)
                except StopIteration as end:
                    return self._succeed(goal, end.value)
                if self._must_end(goal):
                    break
                self._publish(goal, feedback)
                pace.resumed()
        self._end_early(goal)
        return self._result_class()

    async def _drive_async(self, goal: Any, pace: Pace) -> Any:
        # An async generator cannot return a value: what it yields last is the result.
        held: list[Any] = []
        async with aclosing(self._begin(goal.request)) as generator:
            async for item in generator:
                if self._must_end(goal):
                    break
                for feedback in held:
                    self._publish(goal, feedback)
                held = [item]
                pace.resumed()
            else:
                return self._succeed(goal, held[0] if held else None)
        self._end_early(goal)
        return self._result_class()

    def _succeed(self, goal: Any, payload: Any) -> Any:
        result = self._to_result(payload)
        goal.succeed()
        return result

    def _publish(self, goal: Any, payload: Any) -> None:
        if payload is not None:
            goal.publish_feedback(self._to_feedback(payload))

    def _must_end(self, goal: Any) -> bool:
        return goal.is_cancel_requested or self.is_ending() or self._queue.is_superseded(goal)

    def is_ending(self) -> bool:
        """Return whether goals are neither accepted nor continued."""
        return self._node.services.stop.is_set or not self._node.gate.serves

    def _end_early(self, goal: Any) -> bool:
        """Give a goal that may not go on its final state; return whether it was such a one."""
        if goal.is_cancel_requested:
            goal.canceled()
        elif self._must_end(goal):
            goal.abort()
        else:
            return False
        return True
