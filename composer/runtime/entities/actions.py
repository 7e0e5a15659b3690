"""Actions: goals are accepted, executed as `concurrency` says, and cancelled at a `yield`."""

from __future__ import annotations

import threading
from collections import deque
from contextlib import aclosing, closing, suppress
from dataclasses import replace
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.action import CancelResponse, GoalResponse
from rclpy.action.server import RCLError
from rclpy.qos import QoSProfile

from composer.errors import AbortedError
from composer.interfaces.classes import import_interface
from composer.python_source.function_kinds import FunctionKind
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.calls import FAILED, return_result
from composer.runtime.behaviours.running_calls import Owner, Progress
from composer.runtime.entities.local_goals import GoalServer
from composer.runtime.messages.ownership import ownership_of
from composer.runtime.messages.payloads import converter_for
from composer.runtime.nodes.goals import STATUS_NAMES
from composer.runtime.tracing.tracer import COROUTINE, tracer

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import ActionSpec, Concurrency
    from composer.runtime.behaviours.calls import BehaviourCall
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.system_handle import EventKind

_POLL_SEC = 0.005
# A request to cancel takes effect right after its callback; this only bounds an error of rclpy.
_CANCEL_SEC = 5.0
# The middleware's default of 10 loses requests when more goals come at once.
_SERVICE_QOS = QoSProfile(depth=1000)


class ActionServer(GoalServer):
    """An action server whose plain and generator behaviours run in threads of their own.

    The stock server executes goals in the threads of the executor, where goals that sleep keep
    requests to cancel them from being taken.
    """

    def __init__(self, node: LiveNode, spec: ActionSpec) -> None:
        self._queue = GoalQueue(spec.concurrency, _start)
        self._execution = _Execution(node, spec, self._queue)
        self._live_node = node
        self._owner = Owner('action', spec.name)
        self._accept = self._create_accept(spec)
        self._tokens: dict[bytes, int] = {}
        super().__init__(
            node.ros,
            import_interface(spec.type),
            spec.action,
            execute_callback=self._execute_as_now,
            callback_group=node.serving,
            goal_callback=self._decide,
            handle_accepted_callback=self._add,
            cancel_callback=self._cancel,
            goal_service_qos_profile=_SERVICE_QOS,
            result_service_qos_profile=_SERVICE_QOS,
            cancel_service_qos_profile=_SERVICE_QOS,
        )

        key = node.ros.resolve_action_name(spec.action), self.action_type
        services = node.system.services
        self.local = services.add_server(node.ros, self, key, _SERVICE_QOS.depth)
        self.local.allow(is_allowed=spec.local_delivery)
        node.at_destruction.append(self.destroy)

    def retire(self, *, is_retired: bool, aborts: bool = False) -> None:
        """Accept no more goals, or again.

        Args:
            aborts: Whether to abort the goals in flight: functions run to their end, generators
                to their next `yield`.
        """
        self._queue.is_closed = is_retired
        self._queue.aborts = is_retired and aborts

    @property
    def has_goals(self) -> bool:
        """Whether a goal is in flight."""
        return bool(self._tokens)

    def change(self, spec: ActionSpec) -> None:
        """See `LiveEntity`: goals that have begun end as they began."""
        self._queue.concurrency = spec.concurrency
        self.local.allow(is_allowed=spec.local_delivery)
        self._execution = _Execution(self._live_node, spec, self._queue)
        self._accept = self._create_accept(spec)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        with suppress(ValueError):
            self._live_node.at_destruction.remove(self.destroy)
        self._live_node.system.services.remove(self.local)
        super().destroy()

    def add_future(self, future: Any) -> None:
        """Let results be sent by the thread that they come from: see the base class.

        Otherwise the executor sends them, which may have been stopped by then.
        """

    def remove_future(self, future: Any) -> None:
        """See the base class."""

    def notify_execute(self, goal_handle: Any, execute_callback: Any) -> None:
        """See the base class."""
        callback = execute_callback or self._execution.execute
        if self._execution.is_async:
            self._live_node.system.executor.create_task(self._execute, callback, goal_handle)
        else:
            threading.Thread(
                target=self._execute_here, args=(callback, goal_handle), daemon=True
            ).start()

    async def _execute_as_now(self, goal: Any) -> Any:
        # An edit may have put another one in its place.
        return await self._execution.execute(goal)

    def _create_accept(self, spec: ActionSpec) -> BehaviourCall | None:
        if spec.accept is None:
            return None
        node = self._live_node
        return node.call(
            replace(self._owner, key='accept'),
            spec.accept.path,
            node.bind(spec.accept),
            options=spec,
            deliver=return_result,
            may_begin=node.gate.allows_requests,
        )

    def _execute_here(self, callback: Any, goal: Any) -> None:
        # Nothing in it waits, so that it ends when it is first resumed.
        with suppress(StopIteration):
            self._execute(callback, goal).send(None)

    async def _execute(self, callback: Any, goal: Any) -> None:
        try:
            await self._execute_goal(callback, goal)
        finally:
            self._live_node.running.end(self._tokens.pop(goal_key(goal)))

    def _add(self, goal: Any) -> None:
        # The node has not ended before the results of all its goals are sent.
        self._tokens[goal_key(goal)] = self._live_node.running.begin()
        self._queue.add(goal)

    async def _decide(self, goal: Any) -> GoalResponse:
        self._execution.tell('goal', goal)
        if self._execution.is_ending() or not self._queue.has_room():
            return GoalResponse.REJECT
        if self._accept is None:
            return GoalResponse.ACCEPT
        answer = await self._accept.complete(goal)
        if answer is FAILED:
            return GoalResponse.REJECT
        if answer is False or isinstance(answer, str):
            reason = f': {answer}' if answer else ''
            self._live_node.ros.get_logger().info(f'{self._owner} refused a goal{reason}')
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _cancel(self, goal: Any) -> CancelResponse:
        self._execution.tell('cancel', goal.request)
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
    """Runs the behaviour of an action for one goal after another.

    Attributes:
        is_async: Whether the behaviour waits in coroutines.
    """

    def __init__(self, node: LiveNode, spec: ActionSpec, queue: GoalQueue) -> None:
        action_class: Any = import_interface(spec.type)
        self._node = node
        self._queue = queue
        self._name = node.ros.resolve_action_name(spec.action)
        self._node_name = node.full_name
        self._owner = Owner('action', spec.name)
        self._begin = node.bind(spec.behaviour, self._owner)
        self._result_class = action_class.Result
        self._to_result = converter_for(action_class.Result).convert
        self._to_feedback = converter_for(action_class.Feedback).convert
        run = {
            FunctionKind.GENERATOR: self._run_generator,
            FunctionKind.ASYNC_GENERATOR: self._run_async_generator,
            FunctionKind.COROUTINE: self._run_coroutine,
            FunctionKind.PLAIN: self._run_function,
        }[kind_of(self._begin)]
        self._call = node.call(self._owner, spec.path, run, options=spec, deliver=return_result)
        self.is_async = self._call.is_async

    async def execute(self, goal: Any) -> Any:
        """Return the result of a goal, which has its final state then."""
        result = FAILED
        try:
            with tracer.noting('goal', self._node_name, self._name, COROUTINE):
                if not self._end_early(goal):
                    progress = Progress()
                    result = await self._call.with_progress(progress).complete(goal, progress)
                if goal.is_active:
                    # Its behaviour raised.
                    goal.abort()
                result = self._result_class() if result is FAILED else result
                self._tell_result(goal, result)
                return result
        finally:
            self._queue.finished(goal)

    def tell(self, kind: EventKind, message: Any) -> None:
        """Tell who observes the system."""
        self._node.system.tell(kind, self._node_name, self._name, message)

    def _tell_result(self, goal: Any, result: Any) -> None:
        if (observe := self._node.system.observe) is not None:
            status = STATUS_NAMES.get(goal.status, 'unknown')
            copy = ownership_of(self._result_class).copy
            observe('result', self._node_name, self._name, (status, copy(result)))

    def is_ending(self) -> bool:
        """Return whether goals are neither accepted nor continued."""
        gate = self._node.gate
        return self._node.system.stop.is_set or not gate.serves or gate.rests

    def _run_function(self, goal: Any, _progress: Progress) -> Any:
        try:
            return self._succeed(goal, self._begin(goal.request))
        except AbortedError as error:
            return self._abort(goal, error)

    async def _run_coroutine(self, goal: Any, _progress: Progress) -> Any:
        try:
            return self._succeed(goal, await self._begin(goal.request))
        except AbortedError as error:
            return self._abort(goal, error)

    def _run_generator(self, goal: Any, progress: Progress) -> Any:
        try:
            with closing(self._begin(goal.request)) as generator:
                while True:
                    try:
                        feedback = next(generator)
                    except StopIteration as end:
                        return self._succeed(goal, end.value)
                    if self._must_end(goal):
                        return self._end_at_yield(goal, generator)
                    self._publish(goal, feedback)
                    progress.resume()
        except AbortedError as error:
            return self._abort(goal, error)

    def _end_at_yield(self, goal: Any, generator: Any) -> Any:
        """End a goal that may not go on; what its generator returns then is the result."""
        payload = None
        try:
            generator.throw(GeneratorExit())
        except GeneratorExit:
            pass
        except StopIteration as end:
            payload = end.value
        result = self._result_class() if payload is None else self._to_result(payload)
        self._end_early(goal)
        return result

    async def _run_async_generator(self, goal: Any, progress: Progress) -> Any:
        # An async generator cannot return a value: what it yields last is the result.
        held: list[Any] = []
        try:
            async with aclosing(self._begin(goal.request)) as generator:
                async for item in generator:
                    if self._must_end(goal):
                        break
                    for feedback in held:
                        self._publish(goal, feedback)
                    held = [item]
                    progress.resume()
                else:
                    return self._succeed(goal, held[0] if held else None)
        except AbortedError as error:
            return self._abort(goal, error)
        self._end_early(goal)
        return self._result_class()

    def _abort(self, goal: Any, error: AbortedError) -> Any:
        """End a goal as its behaviour has planned; no error of the node."""
        result = self._result_class() if error.result is None else self._to_result(error.result)
        reason = f': {error}' if str(error) else ''
        self._node.ros.get_logger().info(f'{self._owner} aborted a goal{reason}')
        goal.abort()
        return result

    def _succeed(self, goal: Any, payload: Any) -> Any:
        result = self._to_result(payload)
        goal.succeed()
        return result

    def _publish(self, goal: Any, payload: Any) -> None:
        if payload is not None:
            feedback = self._to_feedback(payload)
            self.tell('feedback', feedback)
            goal.publish_feedback(feedback)

    def _must_end(self, goal: Any) -> bool:
        return goal.is_cancel_requested or self._must_abort(goal)

    def _must_abort(self, goal: Any) -> bool:
        return self.is_ending() or self._queue.aborts or self._queue.is_superseded(goal)

    def _end_early(self, goal: Any) -> bool:
        """Give a goal that may not go on its final state; return whether it was such a one."""
        if goal.is_cancel_requested:
            goal.canceled()
        elif self._must_abort(goal):
            goal.abort()
        else:
            return False
        return True


class GoalQueue:
    """The goals of one action that run or wait.

    Args:
        start: Begins to execute a goal; `finished` is called when it has ended.

    Attributes:
        concurrency: What becomes of goals that come while one runs.
        is_closed: Whether no more goals are accepted.
        aborts: Whether those that run are to end.
    """

    def __init__(self, concurrency: Concurrency, start: Callable[[Any], None]) -> None:
        self.concurrency = concurrency
        self.is_closed = False
        self.aborts = False
        self._start = start
        self._running: dict[bytes, Any] = {}
        self._waiting: deque[Any] = deque()
        self._superseded: set[bytes] = set()
        self._lock = threading.Lock()

    def has_room(self) -> bool:
        """Return whether another goal may be accepted now."""
        with self._lock:
            return not self.is_closed and (self.concurrency != 'reject' or not self._running)

    def add(self, goal: Any) -> None:
        """Run an accepted goal now or later."""
        superseded: list[Any] = []
        with self._lock:
            waits = bool(self._running) and self.concurrency in ('queue', 'preempt')
            if self.concurrency == 'preempt':
                self._superseded.update(self._running)
                superseded = list(self._waiting)
                self._waiting.clear()
                self._superseded.update(goal_key(other) for other in superseded)
            if waits:
                self._waiting.append(goal)
            else:
                self._running[goal_key(goal)] = goal
        for other in superseded:
            # It never ran: executing it only gives it its final state.
            self._start(other)
        if not waits:
            self._start(goal)

    def is_superseded(self, goal: Any) -> bool:
        """Return whether a newer goal has taken this one's place."""
        return goal_key(goal) in self._superseded

    def take_out(self, goal: Any) -> bool:
        """Remove a goal that waits; return whether it was waiting."""
        with self._lock:
            if goal not in self._waiting:
                return False
            self._waiting.remove(goal)
            return True

    def finished(self, goal: Any) -> None:
        """Remove a goal that has ended, and start the one that waited for it."""
        following = None
        with self._lock:
            was_running = self._running.pop(goal_key(goal), None) is not None
            self._superseded.discard(goal_key(goal))
            if was_running and self._waiting and not self._running:
                following = self._waiting.popleft()
                self._running[goal_key(following)] = following
        if following is not None:
            self._start(following)


def goal_key(goal: Any) -> bytes:
    """Return the identifier of a goal handle, which is not hashable itself."""
    return bytes(goal.goal_id.uuid)
